"""Q4: bare except, print, mutable defaults, sleeping callbacks."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers import beside
from helpers.course import PACKAGE
from helpers.quality_examples import CONTROLLER, facts, judged, reference

from grader.checks.check_habits import test_callbacks_do_not_sleep as sleeping
from grader.checks.check_habits import test_no_bare_except_print_or_mutable_default as habits
from grader.quality.linting import CALLED_AT_ONCE, bad_habits
from grader.quality.parsed_module import CallGraph, parse

TEXTS = beside(__file__)


def rules(text: str, path: str = CONTROLLER) -> list[str]:
    module = parse(path, text.encode(), PACKAGE)
    return [finding.rule for finding in bad_habits([module], CallGraph([module]))]


# -- except, print, defaults ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("try:\n    x = 1\nexcept:\n    pass\n", "bare-except"),
        ("def f():\n    try:\n        g()\n    except:  # noqa\n        raise\n", "bare-except"),
        ("print('hello')\n", "print"),
        ("class A:\n    def f(self):\n        print(self)\n", "print"),
        ("def f(x=[]):\n    pass\n", "mutable-default"),
        ("def f(*, x={}):\n    pass\n", "mutable-default"),
        ("def f(x=dict()):\n    pass\n", "mutable-default"),
        ("f = lambda x=[1]: x\n", "mutable-default"),
        ("async def f(x=set()):\n    pass\n", "mutable-default"),
    ],
)
def test_a_bad_habit_is_found(text: str, rule: str):
    assert rules(text) == [rule]


@pytest.mark.parametrize(
    ("callback", "found"),
    [
        ("self.tick()", ["`create_timer` gets what `self.tick()` returns, None: write `self.tick`"]),
        ("callback=tick()", ["`create_timer` gets what `tick()` returns, None: write `tick`"]),
        ("self.tick", []),
        ("self.made(1)", []),
        ("partial(tick)", []),
        ("lambda: self.tick()", []),
    ],
)
def test_a_callback_that_is_called_where_it_is_to_be_named_is_found(callback: str, found: list[str]):
    """`create_timer(period, self._fuse())` ended the node with a bare TypeError in given lines."""
    text = (
        "class A:\n    def __init__(self):\n        self.create_timer(0.1, {})\n    def tick(self):\n        pass\n"
        "    def made(self, n):\n        return lambda: n\ndef tick():\n    return\n"
    )
    module = parse(CONTROLLER, text.format(callback).encode(), PACKAGE)
    assert [one.text for one in bad_habits([module], CallGraph([module])) if one.rule == CALLED_AT_ONCE] == found


@pytest.mark.parametrize(
    "text",
    [
        "try:\n    x = 1\nexcept Exception:\n    pass\n",
        "try:\n    x = 1\nexcept (ValueError, OSError):\n    pass\n",
        "def f(x=None, y=(), z=1.0, w='text'):\n    pass\n",
        "class A:\n    def print(self):\n        self.print()\n",
        "def f(x=frozenset()):\n    pass\n",
        "'''print('hello')'''\n",
    ],
)
def test_similar_good_code_is_not_a_finding(text: str):
    assert rules(text) == []


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("scripts/demo.py", "print('driving')\n"),
        ("test/test_x.py", "def test(x=[]):\n    print(x)\n"),
        (CONTROLLER, "def main():\n    while True:\n        pass\n"),
    ],
    ids=["a script prints", "a test", "a loop outside of callbacks"],
)
def test_what_is_a_bad_habit_depends_on_the_place(path: str, text: str):
    assert rules(text, path) == []


# -- sleeping ---------------------------------------------------------------------------------------------------------

NODE = TEXTS["NODE"]
REGISTER = "self.create_timer(0.1, self.callback)"


@pytest.mark.parametrize(
    "register",
    [
        "self.create_timer(0.1, self.callback)",
        "self.create_timer(timer_period_sec=0.1, callback=self.callback)",
        "self.create_subscription(LaserScan, 'scan', self.callback, 10)",
        "self.create_subscription(LaserScan, 'scan', callback=self.callback, qos_profile=10)",
        "self.create_service(SetSpeed, 'set_speed', self.callback)",
        "ActionServer(self, Navigate, 'navigate', self.callback)",
        "ActionServer(self, Navigate, 'navigate', execute_callback=self.callback)",
        "rclpy.action.ActionServer(self, Navigate, 'navigate', execute, cancel_callback=self.callback)",
        "self.create_timer(0.1, lambda: self.callback(None))",
        "self.create_timer(0.1, partial(self.callback, None))",
        "self.add_on_set_parameters_callback(self.callback)",
    ],
)
def test_functions_handed_to_the_executor_are_callbacks(register: str):
    text = NODE.format(register=register, body="return time.sleep(1)", helper="pass")
    assert rules(text) == ["sleep-in-callback"]


@pytest.mark.parametrize(
    "sleep", ["time.sleep(1)", "sleep(1)", "nap(0.1)", "clock.sleep(x)", "self.get_clock().sleep_for(x)"]
)
def test_every_way_to_call_sleep_is_found(sleep: str):
    """Also without its import: Q4 passed, and the callback raised a NameError."""
    text = NODE.format(register=REGISTER, body=sleep, helper="pass")
    assert rules(text) == ["sleep-in-callback"]
    without = "\n".join(line for line in text.splitlines() if line != "import time")
    assert rules(without) == ["sleep-in-callback"]


@pytest.mark.parametrize("way", ["self.helper()", "x = [self.helper() for _ in y]", "return super().rest()"])
def test_functions_called_by_a_callback_belong_to_it(way: str):
    helper = "while True: time.sleep(0.1)" if "helper" in way else "pass"
    found = rules(NODE.format(register=REGISTER, body=way, helper=helper))
    assert found == ["loop-in-callback", "sleep-in-callback"][helper == "pass" :]


@pytest.mark.parametrize(
    ("loop", "found"),
    [
        ("while True: pass", True),
        ("while rclpy.ok(): self.publish()", True),
        ("while not self.arrived: rclpy.spin_once(self)", True),
        ("while True: break", False),
        ("while self.waiting: self.waiting.pop()", False),
        ("while self.count < 3: self.count += 1", False),
        ("while x < 3: x += 1", False),
    ],
)
def test_a_loop_that_waits_for_another_callback_is_found_in_a_callback(loop: str, found: bool):
    """The node is deaf for as long as it runs; a loop that counts or empties a list ends by itself."""
    text = NODE.format(register=REGISTER, body=loop, helper="pass")
    assert (rules(text) == ["loop-in-callback"]) is found


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("pass", "the sleep is in a method that no callback calls"),
        ("threading.Thread(target=self.loop).start()", "a thread of its own may sleep"),
        ("self.get_clock().now()", "asking for the time is not sleeping"),
        ("asyncio.sleep(1)", "another sleep"),
        ("robot.sleep()", "a method of another class"),
    ],
)
def test_other_sleeps_and_calls_are_not_findings(body: str, why: str):
    assert rules(NODE.format(register=REGISTER, body=body, helper="time.sleep(1)")) == [], why


def test_a_sleep_in_main_or_in_the_demonstration_is_allowed():
    assert rules("import time\n\n\ndef main():\n    time.sleep(1)\n") == []
    assert rules(NODE.format(register=REGISTER, body="time.sleep(1)", helper="pass"), "scripts/demo.py") == []


def test_functions_that_call_each_other_do_not_loop_forever():
    text = NODE.format(register=REGISTER, body="self.helper()", helper="self.callback(self.helper())")
    assert rules(text) == []


# -- what explains a silent node, and costs nothing -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "found"),
    [
        ("rclpy.spin_until_future_complete(self, future)", ["spin-in-callback"]),
        ("rclpy.spin_once(self)", ["spin-in-callback"]),
        ("rclpy.spin_once(self.asker)", []),
        ("rclpy.spin_until_future_complete(self.asker, future)", ["wait-in-callback"]),
        ("answer = self.client.call(request)", ["wait-in-callback"]),
        ("self._scan_client.wait_for_service()", ["wait-in-callback"]),
        ("self.navigator.send_goal(goal)", ["wait-in-callback"]),
        ("self.client.wait_for_service(timeout_sec=1.0)", []),
        ("future = self.client.call_async(request)", []),
        ("self.phone.call('home')", []),
    ],
)
def test_a_wait_for_another_callback_is_found_in_a_callback(body: str, found: list[str]):
    """A service that waits for a service: with one thread the answer can never come."""
    text = "import rclpy\n" + NODE.format(register=REGISTER, body=body, helper="pass")
    assert rules(text) == found


@pytest.mark.parametrize(("body", "found"), [("pass", True), ("return", True), ("return message", False)])
def test_a_service_whose_callback_returns_nothing_is_named(body: str, found: bool):
    register = "self.create_service(GetRobotStatus, 'get_status', self.callback)"
    module = parse(CONTROLLER, NODE.format(register=register, body=body, helper="pass").encode(), PACKAGE)
    words = [finding.text for finding in bad_habits([module], CallGraph([module]))]
    assert words == (["`callback`, the callback of get_status, returns None"] if found else [])


def test_another_clock_is_found_in_a_callback():
    assert rules(NODE.format(register=REGISTER, body="now = clock.time()", helper="pass")) == ["wall-clock"]


def test_a_sleep_in_a_test_is_found_and_costs_nothing_of_q4(tmp_path: Path):
    test = "import time\n\n\ndef test_it():\n    time.sleep(1)\n    assert True\n"
    assert rules(test, "test/test_x.py") == ["sleep-in-test"]
    found = facts(reference(tmp_path, files={"test/test_x.py": test}))
    assert judged(sleeping, found).share == judged(habits, found).share == 1
