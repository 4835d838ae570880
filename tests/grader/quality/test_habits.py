"""Q4: bare except, print, mutable defaults, sleeping callbacks, numbers that should be parameters."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.quality_examples import (
    CONTROLLER,
    MOTION,
    NAVIGATOR,
    PROCESSOR,
    REFERENCE,
    facts,
    judged,
    reference,
    written,
)

from grader.checks.check_habits import test_callbacks_do_not_sleep as sleeping
from grader.checks.check_habits import test_contract_numbers_are_parameters as numbers
from grader.checks.check_habits import test_no_bare_except_print_or_mutable_default as habits
from grader.quality.call_graph import CallGraph
from grader.quality.habits import bad_habits
from grader.quality.parameters import parameter_use
from grader.quality.parsed_module import parse


def rules(text: str, path: str = CONTROLLER) -> list[str]:
    module = parse(path, text.encode())
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


def test_a_script_may_print():
    assert rules("print('driving')\n", "scripts/demo.py") == []


def test_tests_are_not_judged():
    assert rules("def test(x=[]):\n    print(x)\n", "test/test_x.py") == []


def test_eight_prints_lose_everything(tmp_path: Path):
    """Blatant."""
    text = (REFERENCE / PROCESSOR).read_text() + "\n\ndef tell():\n" + "    print('hello')\n" * 8
    result = judged(habits, facts(reference(tmp_path, files={PROCESSOR: text})))
    assert result.share == 0.0
    assert "print (8 times): the node's logger adds the node" in result.seen


def test_one_mutable_default_in_a_helper_costs_a_quarter(tmp_path: Path):
    """Subtle."""
    text = (REFERENCE / MOTION).read_text() + "\n\ndef note(value, seen=[]):\n    seen.append(value)\n    return seen\n"
    result = judged(habits, facts(reference(tmp_path, files={MOTION: text})))
    assert result.share == 0.75
    assert f"{MOTION}:" in result.seen
    assert "shared by all calls" in result.seen


# -- sleeping ---------------------------------------------------------------------------------------------------------

NODE = """\
import time
from time import sleep, sleep as nap
import time as clock
from functools import partial
import threading


class Base:
    def rest(self):
        time.sleep(1)


class RobotController(Base):
    def __init__(self):
        {register}

    def callback(self, message):
        {body}

    def helper(self):
        {helper}

    def loop(self):
        time.sleep(1)
"""
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
        "for topic, callback in (('a', self.callback),): self.create_subscription(T, topic, callback, 10)",
    ],
)
def test_functions_handed_to_the_executor_are_callbacks(register: str):
    text = NODE.format(register=register, body="time.sleep(1)", helper="pass")
    assert rules(text) == ["sleep-in-callback"]


@pytest.mark.parametrize("sleep", ["time.sleep(1)", "sleep(1)", "nap(0.1)", "clock.sleep(x)"])
def test_every_way_to_call_sleep_is_found(sleep: str):
    assert rules(NODE.format(register=REGISTER, body=sleep, helper="pass")) == ["sleep-in-callback"]


@pytest.mark.parametrize("way", ["self.helper()", "x = [self.helper() for _ in y]", "return super().rest()"])
def test_functions_called_by_a_callback_belong_to_it(way: str):
    helper = "while True: time.sleep(0.1)" if "helper" in way else "pass"
    assert rules(NODE.format(register=REGISTER, body=way, helper=helper)) == ["sleep-in-callback"]


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


def test_a_sleep_in_another_module_is_followed():
    calling = """\
from ros2_robot_controller.utils.wait import pause


class RobotController:
    def __init__(self):
        self.create_timer(1, self.tick)

    def tick(self):
        pause()
"""
    node = parse(CONTROLLER, calling.encode())
    helper = parse("ros2_robot_controller/utils/wait.py", b"import time\n\n\ndef pause():\n    time.sleep(1)\n")
    found = bad_habits([node, helper], CallGraph([node, helper]))
    assert [(finding.path, finding.line) for finding in found] == [("ros2_robot_controller/utils/wait.py", 5)]
    assert "called from the callback `tick`" in found[0].text


def test_functions_that_call_each_other_do_not_loop_forever():
    text = NODE.format(register=REGISTER, body="self.helper()", helper="self.callback(self.helper())")
    assert rules(text) == []


def test_an_action_that_sleeps_until_it_arrives_costs_half(tmp_path: Path):
    """Blatant: what 16 of 24 real action servers do."""
    text = (REFERENCE / NAVIGATOR).read_text().replace("import Enum\n", "import Enum\nimport time\n")
    loop = "while not goal.ending.done():\n            time.sleep(0.1)\n        ending = goal.ending.result()"
    text = text.replace("ending = await goal.ending\n", loop + "\n")
    result = judged(sleeping, facts(reference(tmp_path, files={NAVIGATOR: text})))
    assert result.share == 0.5
    assert "`time.sleep` in the callback `_navigate`" in result.seen
    assert "drives on blindly" in result.seen


def test_a_pause_in_an_overridden_method_of_the_control_loop_costs_half(tmp_path: Path):
    """Subtle: one class registers the timer, another overrides the method that it leads to."""
    head = "        if not self._is_fresh(self._odom_time):\n            return STOP\n"
    changes = (
        (NAVIGATOR, "import Enum\n", "import Enum\nimport time\n"),
        (NAVIGATOR, head, head.replace("return STOP", "time.sleep(0.1)\n            return STOP")),
    )
    result = judged(sleeping, facts(reference(tmp_path, *changes)))
    assert result.share == 0.5
    assert "`time.sleep` in `_wanted`" in result.seen


def test_a_pause_in_a_helper_of_the_control_loop_costs_half(tmp_path: Path):
    """Subtle: two calls away from the timer, in a helper."""
    head = "def ramp(previous: float, wanted: float, largest_rise: float) -> float:\n"
    changes = (
        (MOTION, "import math\n", "import math\nfrom time import sleep\n"),
        (MOTION, head, head + "    sleep(0.001)\n"),
    )
    result = judged(sleeping, facts(reference(tmp_path, *changes)))
    assert result.share == 0.5
    assert f"{MOTION}:" in result.seen


# -- parameters -------------------------------------------------------------------------------------------------------


def test_no_parameters_at_all(tmp_path: Path):
    """Blatant: 70 % of the real packages that publish a Twist."""
    node = "class RobotController:\n    def control(self):\n        return 0.5\n"
    result = judged(numbers, facts(written(tmp_path, {CONTROLLER: node, PROCESSOR: node})))
    assert result.share == 0.0
    assert f"max_linear_speed is not declared in the code ({CONTROLLER}:3 has the number 0.5" in result.seen


def test_one_parameter_declared_and_never_read(tmp_path: Path):
    """Subtle: the margin is a number again."""
    text = (REFERENCE / MOTION).read_text()
    text = text.replace("    safety_margin: float\n", "").replace("limits.safety_margin", "0.3")
    result = judged(numbers, facts(reference(tmp_path, files={MOTION: text})))
    assert result.share == pytest.approx(11 / 12)
    assert "safety_margin is declared but never read" in result.seen


def test_one_parameter_of_the_second_node_not_declared(tmp_path: Path):
    """Subtle."""
    text = (REFERENCE / PROCESSOR).read_text()
    text = text.replace("    'battery_low_threshold': settings.percentage(20.0),\n", "")
    text = text.replace("self._value('battery_low_threshold')", "20.0")
    result = judged(numbers, facts(reference(tmp_path, files={PROCESSOR: text})))
    assert result.share == pytest.approx(11 / 12)
    assert "sensor_processor: battery_low_threshold is not declared in the code" in result.seen


NAMES = (
    "max_linear_speed", "max_angular_speed", "linear_acceleration", "angular_acceleration", "laser_processing_rate",
    "fusion_rate", "obstacle_detection_threshold", "emergency_stop_distance", "safety_margin", "fusion_frequency",
    "battery_low_threshold", "battery_critical_threshold",
)  # fmt: skip


def declare_and_read_one_by_one() -> str:
    return "\n".join(f"self.declare_parameter('{n}', 1.0)\nself.{n} = self.get_parameter('{n}').value" for n in NAMES)


def declare_many() -> str:
    table = ", ".join(f"('{n}', 1.0)" for n in NAMES)
    reads = "\n".join(
        f"self.x{i} = self.get_parameter('{n}').get_parameter_value().double_value" for i, n in enumerate(NAMES)
    )
    return f"self.declare_parameters(namespace='', parameters=[{table}])\n{reads}"


def read_what_declare_returns() -> str:
    return "\n".join(f"self.x{i} = self.declare_parameter('{n}', 1.0).value" for i, n in enumerate(NAMES))


def keep_what_declare_returns() -> str:
    return "\n".join(f"p{i} = self.declare_parameter(name='{n}', value=1.0)" for i, n in enumerate(NAMES))


def a_table_and_a_loop_into_attributes() -> str:
    table = ", ".join(f"'{n}': 1.0" for n in NAMES)
    uses = "\n".join(f"print(self.{n})" for n in NAMES)
    loop = "    self.declare_parameter(n, d)\n    setattr(self, n, self.get_parameter(n).value)"
    return f"P = {{{table}}}\nfor n, d in P.items():\n{loop}\n{uses}"


def a_table_and_a_helper() -> str:
    table = ", ".join(f"'{n}': 1.0" for n in NAMES)
    uses = "\n".join(f"f(self.value('{n}'))" for n in NAMES)
    helper = "def value(self, n):\n    return self.get_parameter(n).value"
    return f"P = {{{table}}}\nfor n, d in P.items():\n    self.declare_parameter(n, d)\n{helper}\n{uses}"


def formatted_names() -> str:
    lines = [f"self.x{i} = self.declare_parameter('{n}', 1.0).value" for i, n in enumerate(NAMES) if "battery" not in n]
    lines += ["self.declare_parameter(f'battery_{level}_threshold', 1.0)"]
    return "\n".join([*lines, "self.get_parameter(f'battery_{level}_threshold').value"])


def a_dataclass_that_a_callback_replaces(uses: bool = True) -> str:
    lines = ["class Config:", *[f"    {n}: float = number(1.0)" for n in NAMES], "class Controller(Node):"]
    lines += ["    def __init__(self):", "        self.add_on_set_parameters_callback(self.take)"]
    lines += ["        for entry in fields(Config):", "            self.declare_parameter(entry.name, entry.default)"]
    lines += ["    def take(self, parameters):", "        values = {p.name: p.value for p in parameters}"]
    lines += ["        self.config = replace(self.config, **values)", "    def control(self):", "        pass"]
    return "\n".join([*lines, *[f"        f(self.config.{n})" for n in NAMES if uses]])


def get_parameters() -> str:
    names = ", ".join(f"'{n}'" for n in NAMES)
    declare = "\n".join(f"self.declare_parameter('{n}', 1.0)" for n in NAMES)
    return f"{declare}\nself.values = [p.value for p in self.get_parameters([{names}])]"


@pytest.mark.parametrize(
    "way",
    [
        declare_and_read_one_by_one, declare_many, read_what_declare_returns, keep_what_declare_returns,
        a_table_and_a_loop_into_attributes, a_table_and_a_helper, get_parameters, formatted_names,
        a_dataclass_that_a_callback_replaces,
    ],
)  # fmt: skip
def test_every_honest_way_to_read_parameters_counts(way):
    uses = parameter_use([parse(CONTROLLER, way().encode())])
    assert [use.name for use in uses if not (use.declared and use.read)] == []


def test_a_table_that_is_declared_and_never_read_counts_as_such():
    table = ", ".join(f"'{n}': 1.0" for n in NAMES)
    text = f"P = {{{table}}}\nfor n, d in P.items():\n    self.declare_parameter(n, d)\nx = self.get_parameter(y)\n"
    uses = parameter_use([parse(CONTROLLER, text.encode())])
    assert all(use.declared and not use.read for use in uses)


def test_the_field_of_a_dataclass_alone_is_no_use_of_it():
    uses = parameter_use([parse(CONTROLLER, a_dataclass_that_a_callback_replaces(uses=False).encode())])
    assert all(use.declared and not use.read for use in uses)


def test_fields_without_a_loop_over_them_are_not_declared():
    text = a_dataclass_that_a_callback_replaces().replace("entry.name", "'robot_name'")
    assert not any(use.declared for use in parameter_use([parse(CONTROLLER, text.encode())]))


def test_a_parameter_only_in_a_comment_or_a_test_is_not_declared():
    comment = parse(CONTROLLER, b"# self.declare_parameter('max_linear_speed', 0.5)\n")
    test = parse("test/test_x.py", b"node.declare_parameter('fusion_rate', 1)\n")
    assert not any(use.declared for use in parameter_use([comment, test]))
