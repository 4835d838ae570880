"""I5: the launch files, run."""

from grader.checks.first_cause import sentence, shown_by
from grader.checks.judge import NAMESPACE, Judge, NotReached, Unjudged, absolute
from grader.evidence import ParameterAnswer, Trial

NODES = ("robot_controller", "sensor_processor")
_OF_PROCESSOR = ("fusion_frequency", "battery_low_threshold")


def test_the_launch_files_start_the_nodes(judge: Judge) -> None:
    """`robot_controller_launch.py` starts both nodes, `sensor_processor_launch.py` the second one alone."""
    wanted = {"launch_robot_controller": set(NODES), "launch_sensor_processor": {"sensor_processor"}}
    for name, nodes in wanted.items():
        trial = judge.trial(name, complete=False)
        found, seen = _started(trial)
        judge.expect(found == nodes, seen, _try_nodes(nodes))
    for name, nodes in (("launch_plain_robot_controller", wanted["launch_robot_controller"]), ("launch_plain_sensor_processor", {"sensor_processor"})):
        found, seen = _started(judge.started(name))
        if found != nodes:
            try_ = "give each DeclareLaunchArgument a default_value; nobody types arguments that have a usual value"
            judge.share(0.5, f"without any argument, {seen}", try_)


def test_each_launch_file_takes_use_sim_time(judge: Judge) -> None:
    """Each launch file declares `use_sim_time`."""
    for name in ("launch_robot_controller", "launch_sensor_processor"):
        trial = judge.trial(name)
        for answer in _answers(trial, "use_sim_time"):
            seen = f"{trial.launch} use_sim_time:=true left {answer.node} with use_sim_time = {answer.value}"
            try_ = "DeclareLaunchArgument('use_sim_time'), and LaunchConfiguration in each node's parameters"
            judge.expect(answer.value is True, seen, try_)
        _expect_declared(judge, trial)
    for answer in _answers(judge.trial("launch_by_wall_robot_controller"), "use_sim_time"):
        seen = f"use_sim_time:=false left {answer.node} with use_sim_time = {answer.value}"
        judge.expect(answer.value is False, seen, "pass LaunchConfiguration('use_sim_time') on, not True")


def test_parameters_come_from_the_yaml_files(judge: Judge) -> None:
    """Parameters come from the YAML files."""
    for name in ("launch_robot_controller", "launch_sensor_processor"):
        trial = judge.trial(name)
        output = trial.process.output_tail if trial.process is not None else ""
        for node in sorted({answer.node for answer in trial.parameters}):
            own = [p for p in trial.choices if (p in _OF_PROCESSOR) == (node == "sensor_processor")]
            seen = f"no file in config/ sets a parameter of {node}"
            judge.expect(bool(own), seen, "list the node's parameters in its file")
            for parameter in own:
                value = next(a.value for a in _answers(trial, parameter) if a.node == node)
                seen = f"{parameter} was {trial.choices[parameter]:g} in the file and {value} in {node}"
                try_ = "does the launch file pass this file, and is its key the node's name?"
                if (cause := shown_by(judge.faults("parameters"), output)) is not None:
                    seen, try_ = f"{sentence(cause)}\n{seen}", cause.cure
                judge.expect(value == trial.choices[parameter], seen, try_)


def test_a_remapping_in_a_launch_file_works(judge: Judge) -> None:
    """A remapping given in the launch file works."""
    # I4 judges a name that the node does not have without a launch file either.
    usual = {name: {endpoint.topic for endpoint in judge.graph(name).endpoints} for name in ("idle_robot_controller", "idle_sensor_processor")}
    trial = judge.trial("launch_remapped")
    tried = 0
    for graph, without, moved in (
        (trial.graph, "idle_robot_controller", {"cmd_vel": "base/cmd_vel", "scan": "front/scan"}),
        (trial.other_graph, "idle_sensor_processor", {"raw_scan": "front/scan", "obstacle_distance": "front/distance"}),
    ):
        topics = {endpoint.topic.removeprefix(f"{NAMESPACE}/") for endpoint in graph.endpoints} if graph else set()
        for old, new in moved.items():
            if old not in usual[without]:
                continue
            tried += 1
            still = f"still has {'/' if absolute(graph, old) else ''}{old}" if old in topics else "has neither"
            seen = f"in the namespace /{NAMESPACE}, with {old} remapped to {new}, the node {still}"
            judge.expect(new in topics, seen, "use relative names: 'scan', not '/scan'")
    if not tried:
        raise NotReached("the nodes have none of the topics that would be remapped (I4)")


def _expect_declared(judge: Judge, trial: Trial) -> None:
    """Expect that the launch file declares use_sim_time.

    A file that only reads the argument works as well where it is given on the command line, and nowhere else.
    """
    listed = trial.others.get("arguments")
    if listed is None or listed.exit_code is None:
        raise Unjudged(f"the trial {trial.name} has no list of the arguments of {trial.launch}")
    seen = f"`ros2 launch --show-args` lists no use_sim_time for {trial.launch}"
    try_ = "add DeclareLaunchArgument('use_sim_time', default_value='false')"
    judge.expect("\n    'use_sim_time':" in listed.output_tail, seen, try_)


def _started(trial: Trial) -> tuple[set[str], str]:
    """Return which of the contract's nodes a launch file started, and in words what it did start.

    Further nodes are allowed, and a process may have other nodes besides its own, such as a helper.
    """
    nodes = {name.rpartition("/")[2] for name in trial.graph.nodes} if trial.graph else set()
    nodes = {name for name in nodes if not name.startswith("launch_ros")}
    output = trial.process.output_tail.strip().splitlines() if trial.process else []
    last = f"; its last output was: {output[-1][:300]}" if output and not nodes else ""
    why = f": {trial.ended}" if trial.ended else ""
    did = ", ".join(sorted(nodes)) or f"no node{why}"
    return nodes & set(NODES), f"{trial.launch} started {did}{last}"


def _try_nodes(wanted: set[str]) -> str:
    return f"one Node action for each of: {', '.join(sorted(wanted))}"


def _answers(trial: Trial, name: str) -> list[ParameterAnswer]:
    return [answer for answer in trial.parameters if answer.name == name]
