"""Launch files in different styles, and the command lines that they start.

Each expectation was compared with those that the real launch 3.4.3 and launch_ros 0.26.6 start for the same file.
"""

from __future__ import annotations

import re

import pytest
from helpers import beside
from helpers.ros2_runs import FILES

TEXTS = beside(__file__)


@pytest.mark.parametrize(
    ("file", "given", "commands"), TEXTS["STARTED"], ids=lambda value: value if type(value) is str else ""
)
def test_a_launch_file_starts_what_the_real_one_does(visitor, file, given, commands):
    """An include leaks, and a group around it restores; a file is passed on as it is, a missing one is not."""
    assert visitor.launch(FILES / f"{file}.launch.py", *given.items()) == commands
    if file == "arguments":
        assert visitor.said == ["the robot is other"]
    if file == "parameters":
        assert re.fullmatch(r"Parameter file path is not a file: \S+/config/missing.yaml", visitor.said[0])


@pytest.mark.slow  # one more launch
def test_timers_and_events_start_one_thing_after_another(launch):
    run = launch("events.launch.py").end()
    assert sorted(run.commands) == [
        "show first --ros-args",
        "show last --ros-args",
        "show later outside --ros-args",
        "show now inside --ros-args -r __ns:=/inside",
        "show second --ros-args",
    ], "what a timer starts is outside the group that holds the timer"
    said = re.findall(r"\[launch.user\]: (.*)", run.out)
    assert said[0] == "hello"
    assert set(said) == {"hello", "first has started", "first has ended", "bye: idle"}
    assert said[-1] == "bye: idle"


@pytest.mark.slow  # one more launch
def test_plain_processes_are_run(launch):
    run = launch("processes.launch.py").end()
    assert run.commands == [
        "echo $DEMO2 | tr a-z A-Z",
        "/usr/bin/pwd",
        "show one two\n",
        "sh -c echo only $DEMO; exit 3",
        "echo no package --ros-args",
    ]
    assert "[shell-1] SET2" in run.out
    assert "[pwd-2] /usr/lib" in run.out
    assert "[sh-4] only env" in run.out
    assert (run.ended("sh-4")["exit_code"], run.ended("shell-1")["exit_code"]) == (3, 0)
    assert re.search(r"\[ERROR\] \[sh-4\]: process has died \[pid \d+, exit code 3, cmd '.*'\]\.", run.out)
    assert run.code == 0, "that a process fails is no failure of the launch"


def test_a_process_respawns_and_a_required_one_ends_the_launch(launch):
    run = launch("respawning.launch.py").end()
    starts = [e["process"] for e in run.events if e["event"] == "started"]
    assert starts.count("show-1") == 3, "started once and twice again"
    assert run.ended("wait-2")["sent"] == ["SIGINT"]
    assert run.code == 0


def test_a_launch_file_is_found_in_its_package(ros2):
    """It is looked for in the whole share folder; `output='log'`, the default, keeps a node's lines off the screen."""
    done = ros2("launch", "demo", "one.launch.py")
    assert done.returncode == 0
    assert "[INFO] [launch]: All log files can be found below " in done.stdout
    assert "[INFO] [show-1]: process has finished cleanly" in done.stdout
    assert "[show-1] ARGV --ros-args -r __node:=first" in done.stdout
    assert "[show-2] ARGV" not in done.stdout
