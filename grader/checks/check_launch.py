"""The launch files, run."""

import re
from collections.abc import Iterator

from grader.checks.check_parameters import differs
from grader.checks.judge import Judge, Unjudged
from grader.course import launch_stem
from grader.evidence import ParameterAnswer, Trial
from grader.words import mark, say

NEEDS = ("launch", "launch_plain", "launch_by_wall")
_TRY_SHARE = mark(
    "os.path.join(get_package_share_directory('{package}'), ...): a relative path is looked for where `ros2 launch` "
    "is started, not in the package"
)


def test_the_launch_files_start_the_nodes(judge: Judge) -> None:
    """Each launch file starts the nodes that the contract has for it, and no other of the contract's."""
    for path, nodes in judge.course.launch.items():
        found, seen = _started(judge, judge.trial(f"launch_{launch_stem(path)}", complete=False))
        try_ = say("one Node action for each of: {nodes}", nodes=", ".join(sorted(nodes)))
        judge.expect(found == {*nodes}, seen, try_)
    for path, nodes in judge.course.launch.items():
        found, seen = _started(judge, judge.started(f"launch_plain_{launch_stem(path)}"))
        if found != {*nodes}:
            try_ = say("give each DeclareLaunchArgument a default_value, the one that it usually has")
            judge.share(0.5, say("without any argument, {seen}", seen=seen), try_)


def test_each_launch_file_takes_use_sim_time(judge: Judge) -> None:
    """Each launch file declares `use_sim_time`."""
    words = mark("{launch} use_sim_time:={value} left {answer.node} with use_sim_time = {answer.value}")
    for trial in _launched(judge):
        for answer in _answers(trial, "use_sim_time"):
            try_ = say("DeclareLaunchArgument('use_sim_time'), and LaunchConfiguration in each node's parameters")
            judge.expect(answer.value is True, say(words, launch=trial.launch, value="true", answer=answer), try_)
        _expect_declared(judge, trial)
    trial = judge.trial(f"launch_by_wall_{launch_stem(next(iter(judge.course.launch)))}")
    for answer in _answers(trial, "use_sim_time"):
        seen = say(words, launch=trial.launch, value="false", answer=answer)
        judge.expect(answer.value is False, seen, say("pass LaunchConfiguration('use_sim_time') on, not True"))


def test_parameters_come_from_the_yaml_files(judge: Judge) -> None:
    """Parameters come from the YAML files."""
    for trial in _launched(judge):
        output = trial.process.output_tail if trial.process is not None else ""
        for node in sorted({answer.node for answer in trial.parameters}):
            own = [name for name in trial.in_files if name in judge.course.nodes[node].parameters]
            if not own:
                judge.require_installed(judge.course.nodes[node].config)
            seen = say("no installed file sets a parameter of {node}", node=node)
            judge.expect(bool(own), seen, say("list the node's parameters in its file"))
            for parameter in own:
                answer = next(each for each in _answers(trial, parameter) if each.node == node)
                seen = differs(answer, trial.in_files[parameter], node)
                try_ = say("does the launch file pass this file, and is its key the node's name?")
                if not_found := re.search(r"Parameter file path is not a file: (?!/)\S+", output):
                    seen = f"{not_found[0]}\n{seen}"
                    try_ = say(_TRY_SHARE, package=judge.evidence.build.package)
                judge.expect(answer.value == trial.in_files[parameter], seen, try_)


def _expect_declared(judge: Judge, trial: Trial) -> None:
    """Expect that the launch file declares use_sim_time.

    A file that only reads the argument works as well where it is given on the command line, and nowhere else.
    """
    listed = trial.others.get("arguments")
    if listed is None or listed.exit_code is None:
        raise Unjudged(f"the trial {trial.name} has no list of the arguments of {trial.launch}")
    seen = say("`ros2 launch --show-args` lists no use_sim_time for {trial.launch}", trial=trial)
    try_ = say("add DeclareLaunchArgument('use_sim_time', default_value='false')")
    judge.expect("\n    'use_sim_time':" in listed.output_tail, seen, try_)


def _started(judge: Judge, trial: Trial) -> tuple[set[str], str]:
    """Return which of the contract's nodes a launch file started, and in words what it did start.

    Further nodes are allowed, and a process may have other nodes besides its own, such as a helper.
    """
    nodes = {name.rpartition("/")[2] for name in trial.graph.nodes} if trial.graph else set()
    nodes = {name for name in nodes if not name.startswith("launch_ros")}
    output = trial.process.output_tail.strip().splitlines() if trial.process else []
    last = say("; its last output was: {output}", output=output[-1][:300]) if output and not nodes else ""
    why = f": {trial.ended}" if trial.ended else ""
    did = ", ".join(sorted(nodes)) or say("no node{why}", why=why)
    return nodes & {*judge.course.nodes}, say("{trial.launch} started {did}{last}", trial=trial, did=did, last=last)


def _launched(judge: Judge) -> Iterator[Trial]:
    return (judge.trial(f"launch_{launch_stem(path)}") for path in judge.course.launch)


def _answers(trial: Trial, name: str) -> list[ParameterAnswer]:
    return [answer for answer in trial.parameters if answer.name == name]
