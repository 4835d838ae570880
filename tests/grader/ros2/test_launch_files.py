"""A dozen launch files in different styles, and the command lines that they start.

Each expectation was compared with those that the real launch 3.4.3 and launch_ros 0.26.6 start for the same file.
"""

from __future__ import annotations

import re

import pytest

PARAMS = "--params-file SHARE/config/demo.yaml"


def test_a_list_of_nodes_is_started(launch):
    run = launch("plain_list.launch.py").end()
    assert run.commands == [
        f"show --ros-args -r __node:=first {PARAMS}",
        "show --ros-args -r chatter:=talk -r /odom:=odom",
        "show --rate 5 --ros-args --log-level debug --ros-args",
    ]
    assert run.code == 0
    assert "[show-1] ARGV --ros-args -r __node:=first" in run.out
    assert "[show-2] ARGV" not in run.out, "output='log' keeps what a node prints off the screen"


def test_actions_can_be_added_one_by_one(launch):
    run = launch("add_action.launch.py", "who:=you", "unknown:=ignored").end()
    assert run.commands == ["show hello you --ros-args", f"show --ros-args {PARAMS}"]
    assert [e["process"] for e in run.events if e["event"] == "started"] == ["greeter-1", "show-2"]


def test_conditions_depend_on_arguments(launch):
    run = launch("arguments.launch.py").end()
    assert run.commands == [
        "show tb4 --ros-args",
        "show sim:true --ros-args",
        "show robot_true --ros-args",
        "show other --ros-args",
        "show 2.0 --ros-args",
        "show true --ros-args",
        "show false --ros-args",
        "echo ab other",
    ]
    assert "[INFO] [launch.user]: the robot is other" in run.out
    assert "[echo-8] ab other" in run.out


def test_given_arguments_replace_defaults(launch):
    run = launch("arguments.launch.py", "sim:=false", "speed:=1", "speed:=3").end()
    assert run.commands[1:] == [
        "show real:false --ros-args",
        "show robot_false --ros-args",
        "show other --ros-args",
        "show 7 --ros-args",
        "show fast --ros-args",
        "show false --ros-args",
        "show true --ros-args",
        "echo ab other",
    ], "the last of two values wins"


@pytest.mark.slow  # one more launch
def test_an_include_leaks_and_a_group_around_it_does_not(launch):
    run = launch("including.launch.py").end()
    assert run.commands == [
        "show child grouped --ros-args",
        "show grouped by-default --ros-args",
        "show unset unset --ros-args",
        "show child given --ros-args",
        "show given by-default --ros-args",
        "show child again --ros-args",
    ]


@pytest.mark.slow  # one more launch
def test_groups_scope_configurations_and_environment(launch):
    run = launch("groups.launch.py").end()
    assert run.commands == [
        "show outer outer --ros-args",
        "show scoped scoped --ros-args",
        "show outer outer --ros-args",
        "show given outer --ros-args",
        "show none none --ros-args",
        "show kept none --ros-args",
        "show leaked leaked --ros-args",
        "show leaked leaked --ros-args",
    ]


@pytest.mark.slow  # one more launch
def test_namespaces_and_settings_hold_for_a_whole_group(launch):
    run = launch("namespaces.launch.py").end()
    inside = "-p use_sim_time:=True"
    assert run.commands == [
        "show --ros-args -r __node:=n -r __ns:=/robot1",
        "show --ros-args -r __node:=n -r __ns:=/robot1",
        "show --ros-args -r __ns:=/",
        f"show --ros-args -r __node:=n -r __ns:=/fleet {inside}",
        f"show --ros-args -r __ns:=/fleet/robot2 {inside} -r odom:=wheel/odom",
        f"show --ros-args -r __node:=n -r __ns:=/other {inside} --params-file DICT",
        f"show --ros-args -r __ns:=/fleet/deep {inside} -p k:=2.5",
        "show --ros-args -r __node:=n",
    ]


def test_parameters_become_files(launch):
    run = launch("parameters.launch.py", "n:=5").end()
    assert run.commands == [
        "show --ros-args -r __node:=typed -r __ns:=/ns --params-file DICT --params-file DICT",
        "show --ros-args --params-file HERE/config/wild.yaml --params-file DICT",
        "show --ros-args --params-file DICT --params-file HERE/config/wild.yaml",
    ], "files are passed on as they are, one that is not there is dropped"
    assert re.search(r"\[WARNING\].*Parameter file path is not a file: \S+/config/missing.yaml", run.out)


def test_an_opaque_function_sees_the_values(launch):
    run = launch("opaque.launch.py", "count:=3").end()
    assert run.commands == [f"show demo! --ros-args -r __node:=robot{i}" for i in range(3)]


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
    assert set(said) == {"hello", "greeted", "first has started", "first says ARGV", "first has ended", "bye: idle"}
    assert said[-1] == "bye: idle"


@pytest.mark.slow  # one more launch
def test_plain_processes_are_run(launch):
    run = launch("processes.launch.py").end()
    assert run.commands == [
        "echo $DEMO2 | tr a-z A-Z",
        "/usr/bin/pwd",
        "show one two\n",
        "sh -c echo only $DEMO; exit 3",
        "cat Linux\n",
        "env X=1 show --ros-args",
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


@pytest.mark.slow  # one more launch
def test_a_launch_file_can_run_itself(launch, demo, tmp_path, ros2):
    assert launch("main_guard.launch.py", "y:=5").end().commands == ["show 5 --ros-args"]


def test_a_launch_file_is_found_in_its_package(ros2):
    """The file is looked for in the whole share folder, and what it logs goes below ROS_LOG_DIR."""
    done = ros2("launch", "demo", "one.launch.py")
    assert done.returncode == 0
    assert "[INFO] [launch]: All log files can be found below " in done.stdout
    assert "[INFO] [show-1]: process has finished cleanly" in done.stdout
