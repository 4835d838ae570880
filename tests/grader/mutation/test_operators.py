"""What mutants look like, and what is left alone."""

from __future__ import annotations

import pytest
from helpers.course import COURSE
from submissions.toy import source

from grader.mutation.operators import mutants
from grader.mutation.source_text import parse


def texts(text: str, operator: str = "") -> set[str]:
    """Return what the mutants of a text turn its last line into."""
    one = source(text)
    made = [one.apply(change) for change in mutants(one, COURSE) if not operator or change.operator == operator]
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
def test_a_mutant_is_a_mistake_that_people_make(operator: str, before: str, after: str):
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
def test_an_effect_may_be_left_out(kind: str, statement: str):
    assert texts(f"def on_timer(self):\n    x = 1\n    {statement}\n", kind) == {"pass"}


def test_a_callback_may_do_nothing_and_a_service_still_responds():
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
    empty = {change.function: change for change in mutants(one, COURSE) if change.operator == "callback"}
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
def test_code_that_decides_no_behaviour_is_left_alone(text: str):
    assert texts(text) == set()


def test_all_other_bytes_stay_as_they_are():
    """Comments, blank lines, quotes, umlauts and the numbers of later lines included."""
    text = (
        "# Fährt los\nx = 'ä' ; y = 1.0  # m/s\n\n\ndef on_scan(self):\n    self.publish(\n        y)\n    z = y < 2\n"
    )
    one = source(text)
    assert len(mutants(one, COURSE)) == 5
    for change in mutants(one, COURSE):
        new = one.apply(change)
        assert new.count("\n") == text.count("\n")
        changed = [(a, b) for a, b in zip(text.splitlines(), new.splitlines(), strict=True) if a != b]
        assert 1 <= len(changed) <= change.lines[1] - change.lines[0] + 3
    assert any("y = 2.0  # m/s" in one.apply(change) for change in mutants(one, COURSE))


def test_every_mutant_says_where_and_what_was_changed():
    one = source("def near(d, limit):\n    return d < limit\n")
    [mutant] = [change for change in mutants(one, COURSE) if change.operator == "comparison"]
    assert (mutant.path, mutant.line, mutant.function) == ("ros2_robot_controller/node.py", 2, "near")
    assert mutant.words == "`<` became `>=` in `d < limit`"


@pytest.mark.parametrize("text", ["def f(:\n", "x = 1\0\n", "'\ud800'"])
def test_text_that_is_not_python_has_no_mutants(text: str):
    assert parse("node.py", text) is None
