"""What is said first of mistakes that students make: what the program itself said, where, and what to do about it.

The outputs are those of real runs, without what does not matter.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers import beside, judging, recordings
from helpers.course import COURSE
from helpers.judging import Judged, ask, evidence_with, find, with_trials
from submissions.edits import REFERENCE

from grader import tracebacks
from grader.evidence import (
    Call,
    Endpoint,
    Evidence,
    Finding,
    Goal,
    Graph,
    Kind,
    Manifest,
    ParameterAnswer,
    ProcessEnd,
    Quality,
    Reason,
    Sample,
    SourceFile,
    Trial,
)
from grader.intake.package_edits import copy
from grader.intake.package_edits import replace as edited
from grader.quality.source import analyse_package
from grader.scoring.rubric import RUBRIC, load

TEXTS = beside(__file__)

SITE = "/ws/install/lib/python3.12/site-packages/ros2_robot_controller"
RCLPY = "/usr/lib/python3.12/site-packages/rclpy"
IN_GOAL = TEXTS["IN_GOAL"]
NO_INFO = "AttributeError: 'function' object has no attribute 'info'"
ASYNCIO = IN_GOAL.replace(NO_INFO, "RuntimeError: no running event loop")
F8, F9 = find("check_navigation::test_reaches_a_target_ahead"), find("check_goals::test_feedback_comes_at_two_hertz")
LAUNCH = "robot_controller_launch.py"
YAML = "config/robot_params.yaml"
TWIST = Endpoint("cmd_vel", "publisher", "robot_controller", "geometry_msgs/msg/Twist", "reliable")


def trial(name: str, output: str = "", **facts: Any) -> Trial:
    stands = [Sample(t / 20, 0, 0, 0, 0, 0, 0, 0, 0, 1) for t in range(200)]
    usual = {"samples": stands, "process": ProcessEnd("us", None, 9.0, output), "graph": Graph(endpoints=[TWIST])}
    return judging.trial(name, **{**usual, **facts})


def of(*trials: Trial, quality: Quality | None = None) -> Evidence:
    return evidence_with(trials={one.name: one for one in trials}, quality=quality)


def aborted(output: str) -> Evidence:
    goal = Goal(0.5, 2.5, 0.0, 0.1, True, "aborted", False, 0.0, 0.0, 0.6)
    names = ("navigate_ahead", "navigate_beside", "navigate_behind")
    return of(*(trial(name, output, goals=[goal]) for name in names))


@pytest.mark.parametrize(
    ("output", "raised", "cure"),
    [
        (IN_GOAL, "AttributeError: 'function' object has no attribute 'info'", "correct this first: the node runs on"),
        (ASYNCIO, "RuntimeError: no running event loop", "asyncio has no event loop in rclpy's executor: `await` a"),
    ],
)
def test_an_exception_in_an_actions_callback_comes_before_the_goal_that_was_aborted(output, raised, cure):
    """rclpy catches it, and F8 said "aborted; set result.success, call succeed()"."""
    said = ask(F8, aborted(output))
    place = "ros2_robot_controller/navigator.py:75, in `_navigate`"
    assert said.seen.startswith(f"{raised} at {place}\nthe goal ended as aborted")
    assert said.try_.startswith(cure)
    assert said.reason == Reason(Kind.RAISED, said=raised, place=place)
    waits = ask(F9, aborted(output))  # a check that is not reached gets the cause and the cure, too
    assert waits.seen.startswith(f"{raised} at {place}; the robot never moved")
    assert waits.try_.startswith(cure)


def test_an_exception_that_ends_a_thread_comes_before_where_the_others_wait():
    """F6 said "hangs at running.py:45", where the main thread waits for Ctrl-C."""
    ended = Reason(Kind.HANGS, seconds=10.0, place="ros2_robot_controller/utils/running.py:45, in `spin_until`")
    said = ask(F8, of(trial("navigate_ahead", TEXTS["IN_THREAD"], ended=ended)))
    assert said.seen.startswith(
        "ValueError: min() iterable argument is empty at ros2_robot_controller/utils/scans.py:37,"
    )


@pytest.mark.ros
def test_a_node_whose_thread_died_is_not_said_to_hang():
    """The dump of a deaf node shows where the main thread waits."""
    from grader.trials.node_under_test import NodeUnderTest

    node: Any = object.__new__(NodeUnderTest)
    node.process = SimpleNamespace(abort=lambda: None, exit_code=lambda: -6, output=TEXTS["IN_THREAD"])
    node._clock = SimpleNamespace(read=lambda: 0.0, seconds=lambda: 0.0)
    found = node._stopped(Kind.HANGS, 10.0)
    assert (found.kind, found.said) == (Kind.RAISED, "ValueError: min() iterable argument is empty")
    node.process.output = TEXTS["IN_THREAD"].partition("Fatal")[2]
    assert node._stopped(Kind.HANGS, 10.0).place == "ros2_robot_controller/utils/running.py:45, in `spin_until`"


def test_a_traceback_is_kept_though_much_was_written_after_it():
    output = IN_GOAL + "[INFO] driving\n" * 1000
    kept = tracebacks.tail(output, 4000)
    assert len(kept) < 9000
    assert kept.endswith(output[-4000:])
    assert tracebacks.raised(kept) == tracebacks.raised(IN_GOAL)
    assert tracebacks.tail(IN_GOAL, 4000) == IN_GOAL
    deep = IN_GOAL.replace("  File", f'  File "{RCLPY}/task.py", line 1, in send\n    go\n' * 200 + "  File")
    assert tracebacks.raised(tracebacks.tail(deep + "[INFO] driving\n" * 1000, 4000)) == tracebacks.raised(IN_GOAL)


# -- what the graph shows ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("check", "name"),
    [
        ("check_idle::test_publishes_zero_without_a_command", "idle_robot_controller"),
        ("check_set_speed::test_drives_at_the_set_speed", "drive_forward"),
        ("check_navigation::test_reaches_a_target_ahead", "navigate_ahead"),
    ],
)
@pytest.mark.parametrize(
    ("other", "found"),
    [
        (replace(TWIST, type="geometry_msgs/msg/TwistStamped"), "found publisher of geometry_msgs/msg/TwistStamped"),
        (replace(TWIST, topic="robot/cmd_vel"), "found robot/cmd_vel"),
    ],
)
def test_a_command_of_another_type_or_name_is_the_first_cause(check: str, name: str, other: Endpoint, found: str):
    """F1 said "no message on cmd_vel: publish from the control timer"."""
    call = Call(0.5, "set_speed", {"speed": 0.125}, {"success": True, "message": "yes"})
    goal = Goal(0.5, 2.5, 0.0, 0.1, True, "unfinished", None, 0.0, 0.0, float("nan"))
    marks = dict.fromkeys(("cruise", "scans"), 1.5) | {"cruise_end": 3.5}
    facts: dict[str, Any] = {"calls": [call], "goals": [goal], "marks": marks, "choices": {"speed": 0.125}}
    said = ask(find(check), of(trial(name, graph=Graph(endpoints=[other]), **facts)))
    assert said.seen.startswith(f"expected a publisher of cmd_vel (geometry_msgs/msg/Twist); {found} (I4)\n")
    assert said.reason is not None
    assert said.reason.requirements == ("I4",)


def test_the_graphs_own_check_says_so_once():
    other = replace(TWIST, type="geometry_msgs/msg/TwistStamped")
    said = ask(find("check_graph::test_controller_shows_the_contracts_interfaces"),
               of(trial("idle_robot_controller", graph=Graph(endpoints=[other]))))  # fmt: skip
    assert said.seen.count("TwistStamped") == 1


def test_a_lifecycle_node_that_nothing_activates_is_named():
    services = {"robot_controller/change_state": ["lifecycle_msgs/srv/ChangeState"]}
    graph = Graph(endpoints=[TWIST], services=services)
    check = find("check_idle::test_publishes_zero_without_a_command")
    said = ask(check, of(trial("idle_robot_controller", graph=graph)))
    assert said.seen.startswith(
        "robot_controller is a LifecycleNode that nothing has activated, so it publishes nothing\n"
        "no message on cmd_vel in 5 s"
    )
    assert said.try_.startswith("inherit from rclpy.node.Node; or call trigger_configure() and trigger_activate()")


def test_a_node_that_publishes_nothing_is_asked_for_its_timer_last():
    """The topic is there and has its type: only then is the timer meant."""
    said = ask(find("check_idle::test_publishes_zero_without_a_command"), of(trial("idle_robot_controller")))
    assert said.seen == "no message on cmd_vel in 5 s; cmd_vel is on the graph, but no message came"
    assert "is the timer kept, and not cancelled?" in said.try_


# -- launch and parameters --------------------------------------------------------------------------------------------


def package(folder: Path, *edits: tuple[str, str, str]) -> Quality:
    """Return what the text shows of the reference with these edits."""
    made = copy(REFERENCE, folder)
    for file, old, new in edits:
        edited(file, old, new)(made)
    return analyse_package(made, COURSE, lint=False)


@pytest.mark.parametrize(
    ("file", "old", "new", "name", "line", "first"),
    [
        (YAML, "max_linear_speed: 0.5", "max_linear_speed: 1", "max_linear_speed", 6,
         "1, an integer, and the node declares a float (write 1.0); no node"),
        (YAML, "max_linear_speed: 0.5", "max_linear_speed: 0,5", "max_linear_speed", 6,
         "'0,5', a text, and the node declares a float (write 0.5 without quotation marks); no node"),
        (YAML, "robot_name: turtlebot4", "use_sim_time: 'false'", "use_sim_time", 5,
         "'false', a text, and the node declares true or false (write false without quotation marks); no node"),
    ],
)  # fmt: skip
def test_a_parameter_of_another_type_is_named_with_file_and_line(
    tmp_path: Path, file: str, old: str, new: str, name: str, line: int, first: str
):
    """I5 said "process has died, exit code 1", and not what the node had said."""
    ended = Reason(Kind.NOT_UP, "robot_controller", launch=LAUNCH, nodes=("sensor_processor",))
    output = TEXTS["LAUNCHED"].format(name=name)
    down = trial("launch_robot_controller", output, ready=False, ended=ended, launch=LAUNCH)
    text = package(tmp_path, (file, old, new))
    said = ask(find("check_launch::test_the_launch_files_start_the_nodes"), of(down, quality=text))
    assert said.seen.startswith(f"{file}:{line}: `{name}` is {first}")
    assert f"[robot_controller-1] [FATAL] [17.3] [startup]: Trying to set parameter '{name}'" in said.seen
    assert said.seen.endswith("| [ERROR] [robot_controller-1]: process has died [pid 9, exit code 1].")


def test_the_last_exception_of_a_launched_node_leads_to_its_line():
    launched = "".join(f"[robot_controller-1] {line}\n" for line in IN_GOAL.splitlines())
    assert tracebacks.raised(launched) == tracebacks.raised(IN_GOAL)
    ended = Reason(Kind.DIED_EARLY, launch=LAUNCH, exit_code=0)
    end = ProcessEnd("itself", 0, 1.0, launched)
    down = trial("launch_robot_controller", ready=False, ended=ended, launch=ended.launch, process=end)
    said = ask(find("check_launch::test_the_launch_files_start_the_nodes"), of(down))
    raised = "AttributeError: 'function' object has no attribute 'info' (ros2_robot_controller/navigator.py:75, in"
    assert f"`ros2 launch` said: [robot_controller-1] {raised} `_navigate`)" in said.seen


@pytest.mark.parametrize(
    ("ended", "output", "nodes", "by", "said"),
    [
        (Reason(Kind.NOT_UP, "robot_controller", launch=LAUNCH, nodes=("controller",)), "", ["controller"], "us",
         "; is `controller` its name? name= in the launch file, the key in the YAML file and"),
        (Reason(Kind.DIED_EARLY, launch=LAUNCH, exit_code=1),
         "[ERROR] [launch]: Caught exception in launch: ModuleNotFoundError: No module named 'nav2'\n", [], "itself",
         f"{LAUNCH} ended before a node came up, with exit status 1; `ros2 launch` said: [ERROR] [launch]: Caught "
         "exception in launch: ModuleNotFoundError: No module named 'nav2'"),
    ],
    ids=["another name", "a file that raises"],
)  # fmt: skip
def test_a_launch_file_whose_nodes_do_not_come_up_is_explained(ended, output, nodes, by, said):
    end = ProcessEnd(by, None if by == "us" else 1, 1.0, output)
    facts = {"ended": ended, "graph": Graph(nodes=nodes), "launch": LAUNCH, "process": end}
    down = trial("launch_robot_controller", ready=False, **facts)
    assert said in ask(find("check_launch::test_the_launch_files_start_the_nodes"), of(down)).seen


def test_files_that_are_not_installed_are_i1s_fault(tmp_path: Path):
    """I5 said "no file in config/ sets a parameter of robot_controller"."""
    text = package(tmp_path, ("CMakeLists.txt", "install(DIRECTORY launch config", "install(DIRECTORY launch"))
    runs = [trial(f"launch_{node}", launch=f"{node}_launch.py", node=node) for node in COURSE.nodes]
    answer = ParameterAnswer(0.1, "max_linear_speed", value=0.5, node="robot_controller")
    runs[0] = replace(runs[0], parameters=[answer])
    said = ask(find("check_launch::test_parameters_come_from_the_yaml_files"), of(*runs, quality=text))
    assert not said.reached
    assert said.seen == "there is no config/robot_params.yaml in share/ (I1)"


# -- one mistake is charged once --------------------------------------------------------------------------------------


def test_a_refused_cancel_is_not_charged_again_for_a_robot_that_drives_on():
    goal = Goal(0.5, 2.5, 0.0, 0.1, True, "succeeded", True, 0.0, 0.0, 6.0, cancel_t=0.9, cancel_accepted=False)
    runs = [trial(name, goals=[goal]) for name in ("cancel_early", "cancel_late", "cancel_blocked")]
    assert (
        "give the ActionServer a cancel_callback"
        in ask(find("check_goals::test_a_cancelled_goal_ends_as_canceled"), of(*runs)).try_
    )
    again = ask(find("check_goals::test_stands_still_after_a_cancel"), of(*runs))
    assert (again.reached, again.seen) == (False, "the node refused to cancel, so there is no cancelled goal to judge")


def test_an_action_under_another_name_is_not_charged_for_its_type():
    """I3 took half a point for a type that was right: I4 judges the names."""

    def judged(module: str, test: str) -> Judged:
        evidence = recordings.load("reference")
        idle = evidence.trials["idle_robot_controller"]
        assert idle.graph is not None
        graph = replace(idle.graph, actions={"go_to": idle.graph.actions["navigate_to_position"]})
        return ask(find(f"{module}::{test}"), with_trials(evidence, replace(idle, graph=graph)))

    assert judged("check_interfaces", "test_nodes_use_the_contracts_types").share == 1
    named = judged("check_graph", "test_controller_shows_the_contracts_interfaces")
    assert named.share == pytest.approx(5 / 6)
    assert "found go_to (" in named.seen


def test_a_spin_inside_a_callback_is_named_alone_with_its_cure():
    """Two other lines stood beside it, and nothing said what to do."""
    path = "ros2_robot_controller/navigator.py"
    habits = [
        Finding(path, 79, "spin-in-callback", "`rclpy.spin_until_future_complete` in the callback `_navigate`"),
        Finding(path, 85, "loop-in-callback", "`while` in the callback `_navigate`"),
        Finding(path, 86, "sleep-in-callback", "`time.sleep` in the callback `_navigate`"),
    ]
    sent = Goal(0.5, 2.5, 0.0, 0.1, True, "unfinished", None, 0.0, 0.0, float("nan"))
    deaf = trial("navigate_ahead", ended=Reason(Kind.HANGS, seconds=10.0), goals=[sent])
    said = ask(F8, of(deaf, quality=Quality(Manifest(found=True), habits=habits)))
    spins = f"`rclpy.spin_until_future_complete` in the callback `_navigate` at {path}:79: it takes the node from"
    assert said.seen.startswith(spins)
    assert "sleep" not in said.seen + said.try_
    assert said.try_.startswith("make the callback `async def` and `await` the future")
    goal = Goal(
        0.5, 2.5, 0.0, 0.1, True, "unfinished", None, 0.0, 0.0, float("nan"), cancel_t=0.9, cancel_accepted=None
    )
    cancelled = trial("cancel_early", goals=[goal])
    check = find("check_goals::test_a_cancelled_goal_ends_as_canceled")
    assert ask(check, of(cancelled, quality=Quality(Manifest(found=True), habits=habits))).seen.startswith(spins)


def test_a_foreign_package_is_one_reason_for_all_that_is_judged_on_its_nodes():
    """Nine requirements repeated that none of the assignment's modules is there, each as a loss of its own."""
    text = Quality(Manifest(found=True), files=[SourceFile("other/node.py", 90)])
    checks = [
        c.id for c in load(RUBRIC).checks if c.id.startswith(("check_style", "check_docs", "check_hab", "check_str"))
    ]
    said = {ask(find(check), of(quality=text)) for check in checks}
    assert len(checks) > 8
    (one,) = said
    assert not one.reached
    assert one.seen.startswith("none of the assignment's modules is there: ros2_robot_controller/")
    assert one.try_.endswith("start with one of these modules")


def test_a_parameter_callback_that_returns_nothing_gets_a_cure():
    """rclpy ends the node with words that name neither the callback nor what it should return."""
    output = IN_GOAL.replace(
        "'function' object has no attribute 'info'", "'NoneType' object has no attribute 'successful'"
    )
    ended = Reason(Kind.DIED, exit_code=1, seconds=1.0)
    died = trial("navigate_ahead", ended=ended, process=ProcessEnd("itself", 1, 1.0, output))
    said = ask(F8, of(died))
    assert said.seen.startswith("the node ended at 1.00 s with exit status 1; its last output was: ")
    assert said.try_ == "the parameter callback has to return a SetParametersResult on every path, also at its end"
