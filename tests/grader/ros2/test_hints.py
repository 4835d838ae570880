"""What is said beside a refusal or while waiting, and Ctrl-C at a moment at which it would hurt."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from itertools import count

import pytest
from helpers.ros2_runs import COMMAND

from grader.ros2.commands import graph, refusals
from grader.ros2.commands.spinning import interrupt_later

ODOMETRY = "nav_msgs/msg/Odometry"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("/odomm", "\nDid you mean /odom?"),
        ("/navigate", "\nDid you mean /navigate_to_position?"),  # the beginning of just one
        ("/odom", ""),  # it is there
        ("/elsewhere", ""),
    ],
)
def test_the_name_that_was_meant(name, said):
    assert refusals.near(name, ["/odom", "/scan", "/navigate_to_position"]) == said


def test_a_type_that_differs():
    assert graph.other_type("odom", "geometry_msgs/msg/Twist", [ODOMETRY, ODOMETRY]) == (
        "WARNING: /odom is of type nav_msgs/msg/Odometry, not geometry_msgs/msg/Twist"
    )
    assert graph.other_type("/odom", "nav_msgs/Odometry", [ODOMETRY]) == "", "the middle word may be left out"
    assert graph.other_type("/odom", ODOMETRY, []) == ""


def test_a_wait_is_remarked_on_once(monkeypatch, capsys):
    """Not before what is there has been found; the clock here goes on by a second at each look."""
    clock = count()
    monkeypatch.setattr(graph.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(graph.time, "sleep", lambda _s: None)
    answers = iter([False] * 8 + [True])
    graph.wait(lambda: next(answers), "set_sped", "a/srv/B", lambda: [("/set_speed", ["a/srv/B"])])
    assert capsys.readouterr().err == "Did you mean /set_speed?\n"


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """Ctrl-C as at a terminal: whoever starts the tests in the background has it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_is_put_off(ctrl_c):
    done = []

    def press_and_go_on():
        with interrupt_later() as check:
            check()
            os.kill(os.getpid(), signal.SIGINT)
            done.append("what would have been torn in two")

    with pytest.raises(KeyboardInterrupt):
        press_and_go_on()
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_second_ctrl_c_does_not_wait(ctrl_c):
    def press_twice():
        with interrupt_later():
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)
            pytest.fail("went on")

    with pytest.raises(KeyboardInterrupt):
        press_twice()


def test_a_terminal_is_prepared():
    """`source setup.bash` stands for /opt/ros/jazzy/setup.bash: packages, a plain build, and Tab."""
    script = (
        f"source {COMMAND}/setup.bash && printf '%s\\n' $CMAKE_PREFIX_PATH $CMAKE_TOOLCHAIN_FILE && complete -p ros2"
    )
    shell = subprocess.run(
        ["bash", "-c", script], env={"PATH": "/usr/bin:/bin"}, capture_output=True, text=True, check=True
    )
    prefix, toolchain, tab = shell.stdout.splitlines()
    assert prefix == str(COMMAND.parents[1] / ".venv")
    assert toolchain == str(COMMAND / "wheels.cmake")
    assert "_python_argcomplete" in tab
