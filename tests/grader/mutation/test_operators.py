"""The faults: what they look like, and what is left alone."""

from __future__ import annotations

from textwrap import dedent

import pytest
from submissions import toy

from grader.mutation.equivalent_mutants import equivalent_mutants
from grader.mutation.operators import mutants
from grader.mutation.selection import Selector
from grader.mutation.source_text import Change, Source, parse


def source(text: str) -> Source:
    found = parse("ros2_robot_controller/node.py", dedent(text))
    assert found is not None
    return found


def texts(text: str, operator: str = "") -> set[str]:
    """Return the lines that the faults of a text turn its last line into."""
    one = source(text)
    made = [one.apply(change) for change in mutants(one) if not operator or change.operator == operator]
    return {new.rstrip().splitlines()[-1].strip() for new in made}


@pytest.mark.parametrize(
    ("operator", "before", "after"),
    [
        ("comparison", "close = d < limit", "close = d >= limit"),
        ("comparison", "close = low <= d <= high", "close = low > d <= high"),
        ("comparison", "idle = goal is None", "idle = goal is not None"),
        ("comparison", "known = name not in names", "known = name in names"),
        ("sign", "error = target - yaw", "error = target + yaw"),
        ("sign", "back = -speed", "back = speed"),
        ("sign", "step = speed * dt", "step = speed / dt"),
        ("condition", "go = free and ready", "go = free or ready"),
        ("condition", "go = not blocked", "go = (blocked)"),
        ("condition", "x = 1 if blocked else 2", "x = 1 if True else 2"),
        ("condition", "x = 1 if blocked else 2", "x = 1 if False else 2"),
        ("constant", "speed = 0.5", "speed = 1.0"),
        ("constant", "index = 0", "index = 1"),
        ("constant", "nearest = math.inf", "nearest = 0.0"),
        ("constant", "response.success = True", "response.success = False"),
        ("unit", "yaw = math.radians(angle)", "yaw = (angle)"),
        ("unit", "level = 100.0 * share", "level = (share)"),
        ("unit", "seconds = now.nanoseconds * 1e-9", "seconds = (now.nanoseconds)"),
        ("function", "near = min(ranges)", "near = max(ranges)"),
        ("function", "ok = abs(v) + 1", "ok = (v) + 1"),
        ("parameter", "top = self.get_parameter('max_linear_speed').value", "top = 0.5"),
        ("parameter", "top = node.get_parameter('safety_margin').get_parameter_value().double_value", "top = 0.3"),
        ("parameter", "top = self._value('fusion_frequency')", "top = 20.0"),
        ("name", "self.pub = self.create_publisher(Twist, 'cmd_vel', 10)",
         "self.pub = self.create_publisher(Twist, 'cmd_vel2', 10)"),
        ("name", "fused.header.frame_id = 'base_link'", "fused.header.frame_id = 'base_link2'"),
        ("name", "response.status = 'ACTIVE'", "response.status = 'ACTIVE2'"),
        ("qos", "self.create_subscription(Scan, 'scan', self.f, qos_profile_sensor_data)",
         "self.create_subscription(Scan, 'scan', self.f, 10)"),
        ("qos", "qos.reliability = ReliabilityPolicy.BEST_EFFORT", "qos.reliability = ReliabilityPolicy.RELIABLE"),
    ],
)  # fmt: skip
def test_a_fault_is_a_mistake_that_people_make(operator: str, before: str, after: str):
    assert after in texts(before, operator)


@pytest.mark.parametrize(
    ("kind", "statement"),
    [
        ("call", "self.cmd_vel.publish(twist)"),
        ("call", "self.stop_robot()"),
        ("call", "goal_handle.succeed()"),
        ("feedback", "goal_handle.publish_feedback(feedback)"),
        ("assignment", "twist.linear.x = self.speed"),
        ("assignment", "self.pose = odom.pose.pose"),
    ],
)
def test_a_deed_may_be_left_out(kind: str, statement: str):
    assert texts(f"def on_timer(self):\n    x = 1\n    {statement}\n", kind) == {"pass"}


def test_a_callback_may_do_nothing_and_a_service_still_answers():
    one = source(
        """
        class Node:
            def __init__(self):
                self.create_timer(0.1, self._tick)
                self.create_service(SetSpeed, 'set_speed', self._answer)

            def _tick(self):
                '''Say zero.'''
                a = 1
                self.say(a)

            def _answer(self, request, response):
                response.ok = True
                return response
        """
    )
    empty = {change.function: change for change in mutants(one) if change.operator == "callback"}
    assert set(empty) == {"Node._tick", "Node._answer"}
    assert "        '''Say zero.'''\n        pass\n\n\n" in one.apply(empty["Node._tick"])
    assert (
        one.apply(empty["Node._answer"])
        .rstrip()
        .endswith("def _answer(self, request, response):\n        return response")
    )


@pytest.mark.parametrize(
    "text",
    [
        "'''Drive at 0.5 m/s.'''",
        "self.get_logger().info(f'speed {v * 2:.2f} m/s, limit ' + str(-limit))",
        "logger.warning('battery at %d', 100 * level)",
        "print(1 + 2)",
        "x: Literal[1]",
        "def f(a: Optional[1], b: 'x < y') -> Literal[2]: ...",
        "raise ValueError('beyond ' + str(1 - x))",
        "assert x < 1",
        "from . import node",
        "response.message = 'Speed set to ' + str(-speed)",
        "client.wait_for_server(timeout_sec=10.0)",
        "executor = MultiThreadedExecutor(num_threads=4)",
        "executor = MultiThreadedExecutor(4)",
        "done.wait(0.5)",
        "rclpy.spin_once(node, timeout_sec=0.1)",
        "subscription = self.create_subscription(Scan, topic, self.f, 10)",
        "SLACK = 1e-6",
        "round(x, 3)",
        "__all__ = ['scan']",
        "if __name__ == '__main__': main(1 + 1)",
        "while running < 1: x()",
    ],
)
def test_what_changes_no_behaviour_is_left_alone(text: str):
    assert texts(text) == set()


def test_only_the_place_of_the_fault_changes():
    """Comments, blank lines, quotes, umlauts and the numbers of later lines stay as they are."""
    text = (
        "# Fährt los\nx = 'ä' ; y = 1.0  # m/s\n\n\ndef on_scan(self):\n    self.publish(\n        y)\n    z = y < 2\n"
    )
    one = source(text)
    assert len(mutants(one)) == 5
    for change in mutants(one):
        new = one.apply(change)
        assert new.count("\n") == text.count("\n")
        changed = [(a, b) for a, b in zip(text.splitlines(), new.splitlines(), strict=True) if a != b]
        assert 1 <= len(changed) <= change.lines[1] - change.lines[0] + 3
    assert any("y = 2.0  # m/s" in one.apply(change) for change in mutants(one))


def test_every_fault_says_where_and_what():
    one = source("def near(d, limit):\n    return d < limit\n")
    [fault] = [change for change in mutants(one) if change.operator == "comparison"]
    assert (fault.path, fault.line, fault.function) == ("ros2_robot_controller/node.py", 2, "near")
    assert fault.words == "`<` became `>=` in `d < limit`"


@pytest.mark.parametrize("text", ["def f(:\n", "x = 1\0\n", "'\ud800'"])
def test_what_is_no_python_has_no_faults(text: str):
    assert parse("node.py", text) is None


def behaviour(text: str) -> list[object]:
    """Return what the functions of the toy package give for many arguments."""
    space: dict[str, object] = {}
    exec(compile(text, "toy", "exec"), space)
    found: list[object] = []
    numbers = [-2.0, -0.6, -0.5, -0.1, 0.0, 0.1, 0.25, 0.5, 0.6, 1.0, 3.0, float("inf")]
    if "percent" in space:
        found += [space["percent"](x) for x in numbers]
        found += [space["never_called"](x, y) for x in numbers for y in numbers]
    if "RobotController" in space:
        for speed in numbers:
            for distance in numbers:
                robot = space["RobotController"]()
                found.append((robot.set_speed(speed), robot.on_scan(distance), robot.speed, robot.published))
        found += [space["stop_distance"](x) for x in numbers]
    return [repr(item) for item in found]


@pytest.mark.parametrize("text", [toy.CONTROLLER, toy.PROCESSOR])
def test_a_decoy_changes_bytes_and_no_behaviour(text: str):
    one = source(text)
    expected = behaviour(text)
    made = equivalent_mutants(one)
    assert len(made) > 15
    for change in made:
        new = one.apply(change)
        assert new != text
        assert behaviour(new) == expected, change.words


@pytest.mark.parametrize("text", [toy.CONTROLLER, toy.PROCESSOR])
def test_nearly_every_fault_changes_behaviour(text: str):
    def differs(change: Change) -> bool:
        try:
            return behaviour(one.apply(change)) != expected
        except Exception:
            return True

    one = source(text)
    expected = behaviour(text)
    made = mutants(one)
    assert sum(map(differs, made)) >= 0.9 * len(made)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("def f(a):\n    return a < 2", "def f(a):\n    return (2 > a)"),
        ("def f(a):\n    return 0.3", "def f(a):\n    return (0.15 + 0.15)"),
        ("def f(a):\n    if a: g()", "def f(a):\n    if [a][0]: g()"),
        ("def f(a):\n    return g(a)", "def f(a):\n    answer2 = (g(a)); return answer2"),
        ("def f(a):\n    g(a)", "def f(a):\n    [g(a)]"),
        ("def f(a):\n    b = g(a)\n    return b", "def f(a):\n    b2 = g(a)\n    return b2"),
    ],
)
def test_a_decoy_looks_like_a_fault(before: str, after: str):
    one = source(before)
    assert after in [one.apply(change) for change in equivalent_mutants(one)]


GUARDS = [
    "def f(a):\n    if TYPE_CHECKING:\n        return a + 1\n",
    "if TYPE_CHECKING:\n    def f(a):\n        return a + 1\n",
    "if __name__ == '__main__':\n    x = 1\nelse:\n    def f(a):\n        return a + 1\n",
    "def f(a):\n    if a or __name__:\n        return a + 1\n",
    "if __name__ != 'nobody':\n    def f(a):\n        return a + 1\n",
]


@pytest.mark.parametrize("text", GUARDS)
def test_only_a_guard_shields_what_is_in_it(text: str):
    assert "`+` became `-` in `a + 1`" in [change.words for change in mutants(source(text))]


@pytest.mark.parametrize(
    "text",
    [
        "def f(a):\n    if a == 0x" + "f" * 5000 + ":\n        return 1 + a\n",
        "def f(a):\n    if a == 0:\n        return 0\n"
        + "".join(f"    elif a == {i}:\n        return {i}\n" for i in range(400)),
        "def f(a):\n    return " + " + ".join(["a"] * 900) + "\n",
    ],
    ids=["digits", "elif", "sum"],
)
def test_a_module_that_is_too_much_for_python_stops_nobody(text: str):
    """It may have faults or none; the others have theirs."""
    path, other = "ros2_robot_controller/node.py", source("def g(a):\n    return a + 1\n")
    huge = parse(path, text)
    sources = {path: huge} if huge else {}
    for one in sources.values():
        assert isinstance(mutants(one), list)
        assert isinstance(equivalent_mutants(one), list)
    Selector({**sources, "other.py": other}, [])
    assert mutants(other)


def test_a_module_of_a_thousand_lines_is_not_read_anew_for_each_fault():
    """Counted in bytes: it took minutes."""
    long = source(
        "".join(f"def f{n}(a):\n    if a == {n}:\n        return a + {n}\n    return a * 3\n" for n in range(250))
    )
    found = mutants(long)
    assert len(found) >= 1000
    assert long._read < 100 * len(found)


INDENTED = """\
class Node:
    @staticmethod
    def text(a):
        s = \'\'\'
no indentation here
\'\'\'
        return s * a if a > 2 else s + 'x'

    limit = 3 + 4; other = 5 - 1
    rate = 7 * 2  # with a comment
"""


def test_faults_in_methods_strings_and_lines_of_two_statements_are_found():
    words = [change.words for change in mutants(source(INDENTED))]
    for part in ("`a > 2`", "`3 + 4`", "`5 - 1`", "`7 * 2`"):
        assert any(part in each for each in words), (part, words)
