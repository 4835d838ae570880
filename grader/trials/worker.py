"""The trusted process that runs trials, in a network namespace of its own.

For each trial it reads one line of JSON (TrialRequest) from stdin, writes the evidence file and answers with the
trial's name, on what was its stdout when it started. The node under test runs in a sandbox inside the same network;
it can see nothing of this process.
"""

from __future__ import annotations

import json
import math
import os
import random
import sys
import traceback
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

from grader import building, evidence, sandbox
from grader.course import Course, load
from grader.errors import GraderError
from grader.evidence import Kind, Reason
from grader.host import shortage
from grader.trials import catalog, parameter_files
from grader.trials.case import Case
from grader.trials.messages import Reader, interface, own_package, reader
from grader.trials.node_server import ForkedNode, NodeServer, can_fork, node_environment
from grader.trials.node_under_test import NodeUnderTest, TrialOver, has_one_thread
from grader.trials.plan import TrialPlan
from grader.trials.request import CANNOT, READY, TrialRequest, not_started, went_well
from grader.trials.stage import LAUNCH, Stage, source_folder
from grader.trials.what_ran import Notes
from sim import Pose, Simulator, World, load_world

# The `ros2` command, which is mounted alone, so that nothing else of the kit is visible.
_ROS2 = Path(__file__).parents[1] / "ros2"

# Two nodes and a launch file take 0.3 GB.
_LIMITS = sandbox.Limits(wall_seconds=300.0, resident_bytes=1536 * sandbox.MIB)


def main() -> int:
    """Run the trials that stdin asks for, of the course whose folder is the argument; return the exit status."""
    course = load(Path(sys.argv[1]))
    catalog.trials(course)
    answers = _answers()
    print(READY, file=answers, flush=True)
    with closing(Forks()) as forks:
        return _serve(course, answers, forks)


def _serve(course: Course, answers: TextIO, forks: Forks) -> int:
    for line in sys.stdin:
        request = TrialRequest(**json.loads(line))
        case = Case.of(request.case) if request.case else None
        plan = case.plan(request.trial) if case else catalog.trials(course)[request.trial]
        try:
            run_trial(course, plan, request, forks)
        except Exception as error:  # an error of ours must not take the other trials along
            if Path(request.out).is_file():
                # The trial was over. A process that cannot leave the graph starts no other.
                traceback.print_exc()
                return 1
            if problem := _host_problem(error):
                print(CANNOT + problem, file=answers, flush=True)
                continue
            _save(request, not_started(plan, request.seed, traceback.format_exc()))
        print(request.trial, file=answers, flush=True)
    return 0


def _answers() -> TextIO:
    """Return the channel to the grader; whatever else is printed on stdout goes to stderr from now on.

    Fast DDS prints an error on stdout when a message does not fit the observer's type, as for float64 instead of
    float32. That line was once taken for the answer, and ended the whole grading.
    """
    channel = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return channel


def _host_problem(error: Exception) -> str:
    """Return in one line why this machine cannot run a trial now, "" for any other error."""
    return " ".join((str(error) if isinstance(error, GraderError) else shortage.explain(error)).split())


def _save(request: TrialRequest, facts: evidence.Trial) -> None:
    """Write the facts, whole or not at all: it believes the file even if this process crashes later."""
    part = Path(f"{request.out}.part")
    part.write_text(evidence.to_json(facts))
    part.replace(request.out)


class Forks:
    """The sandbox in which nodes are forked, from the first trial on that has such a node until one that spoils it."""

    def __init__(self) -> None:
        self._server: NodeServer | None = None
        self._possible: dict[Path, bool] = {}

    def take(self, plan: TrialPlan, request: TrialRequest) -> NodeServer | None:
        """Return it for a trial, None if that trial's node has to be started plainly, or beside others."""
        install = Path(request.install)
        program = install / "lib" / request.ros_name / plan.node
        plain = plan.launch or plan.params_file or plan.beside or plan.namespace or plan.shows_source
        if plain or not self._possible.setdefault(program, can_fork(install, program)):
            return None
        server, self._server = self._server or NodeServer(install, Path(request.out).parent, _LIMITS), None
        if server.works:
            return server
        server.close()
        self._possible[program] = False
        return None

    def give_back(self, server: NodeServer) -> None:
        """Clear it for the next trial, or end it if that does not work."""
        if server.clear():
            self._server = server
        else:
            server.close()

    def close(self) -> None:
        """End it."""
        if self._server is not None:
            self._server.close()


def run_trial(course: Course, plan: TrialPlan, request: TrialRequest, forks: Forks | None = None) -> None:
    """Start the node in a sandbox, run the trial's script, save what was observed, and leave the graph."""
    install = Path(request.install)
    missing = _missing(plan, install, request.ros_name)
    if missing:
        _save(request, not_started(plan, request.seed, ended=missing))
        return
    seed = plan.case.get("seed", 0) if plan.case else request.seed
    simulator = Simulator(_transformed_world(course, plan, request.seed), seed=seed)
    plan = plan.placed_in(simulator.world)
    with ExitStack() as others:
        server = None
        if forks and (server := forks.take(plan, request)):
            others.callback(forks.give_back, server)
        notes = server.notes if server else others.enter_context(closing(Notes(Path(request.out).parent)))
        notes.begin(functions=plan.notes_functions)
        box, in_files = _sandbox(course, plan, request, notes)
        command = _command(plan, install, request.ros_name)
        process: sandbox.Process | ForkedNode
        if server:
            process = server.start(command, box.environment)
        else:
            process = others.enter_context(sandbox.Process(command, box, _LIMITS))
        programs: list[sandbox.Process | ForkedNode] = [process]

        def start(command: Sequence[str]) -> sandbox.Process:
            other = others.enter_context(sandbox.Process(command, box, _LIMITS))
            programs.append(other)
            return other

        node = NodeUnderTest(
            course, plan, simulator, process, request.domain_id,
            one_thread=bool(request.package) and has_one_thread(Path(request.package)),
            reliable=not request.best_effort, patience_s=request.patience_s,
        )  # fmt: skip
        own_launch = plan.launch and not plan.namespace
        stage = Stage(
            course, plan, request.seed, simulator, node,
            start=start,
            others={name: start(_node_command(request.ros_name, name, names)) for name, names in plan.beside.items()},
            launch_file=_in_sandbox(install, request.ros_name, f"launch/{plan.launch}") if own_launch else "",
            readers=_readers(install, course),
        )  # fmt: skip
        stage.recorded.in_files.update(in_files)
        facts = _play(stage, programs, notes)
        _save(request, facts)  # first: Fast DDS has been seen to crash on leaving
        for name in request.then:
            follower = catalog.trials(course)[name]
            following = _go_on(course, follower, request.seed, stage) if _ended_well(facts, process) else None
            if following is None:
                break
            stage = following
            facts = _play(stage, programs, notes)
            _save(replace(request, trial=name, out=str(Path(request.out).with_name(f"{name}.json"))), facts)
        stage.close()


def _play(stage: Stage, programs: Sequence[sandbox.Process | ForkedNode], notes: Notes) -> evidence.Trial:
    """Run a trial's script and return its facts; the first of `programs` is the node."""
    plan, node, is_up = stage.plan, stage.node, stage.node.ready
    stage.recorded.thresholds.update(node.contract.thresholds({**stage.recorded.in_files, **plan.parameters}))
    ended, script_error = None, ""
    try:
        stage.open()
        notes.look_at(programs[0].pids())
        plan.script(stage)
        node.finish()
    except TrialOver as over:
        ended = over.reason
    except Exception as error:
        if _host_problem(error):
            raise
        script_error = traceback.format_exc()
    notes.look_at(pid for each in programs for pid in each.pids())
    facts = stage.facts(ended, script_error)
    # What a node notes at its start, and which functions run, is the first trial's.
    return replace(facts, ran=notes.read(facts.ready and not is_up))


def _ended_well(facts: evidence.Trial, process: sandbox.Process | ForkedNode) -> bool:
    """Return whether the node may go on with another trial: nothing went wrong, and no parameter was set."""
    is_changed = any(answer.accepted is not None for answer in facts.parameters)
    runs_on = any(goal.accepted and goal.status == "unfinished" for goal in facts.goals)
    in_order = went_well(facts) and facts.pace == "lockstep" and not process.has_ended()
    return in_order and not is_changed and not runs_on


def _go_on(course: Course, plan: TrialPlan, seed: int, stage: Stage) -> Stage | None:
    """Return the stage of another trial of the same running node, None if it does not come to rest."""
    node, readers = stage.node, stage.readers
    for each in (replace(plan, world=TrialPlan.world), plan):
        at = stage.simulator.odometry().pose
        node.go_on(each, simulator := Simulator(_transformed_world(course, each, seed, at), seed=seed))
        stage = Stage(course, each, seed, simulator, node, readers=readers)
        try:
            if each is not plan and not plan.at_rest(stage):
                return None
        except TrialOver:
            return None
    return stage


def _sandbox(
    course: Course, plan: TrialPlan, request: TrialRequest, notes: Notes
) -> tuple[sandbox.Sandbox, dict[str, float]]:
    """Return the trial's sandbox, and the values that were changed in its parameter files."""
    install = Path(request.install)
    visible = {install: str(building.INSTALL), **notes.mounts}
    if request.package and plan.shows_source:
        visible[Path(request.package)] = str(source_folder(course))
    in_files: dict[str, float] = {}
    if plan.launch or plan.params_file:
        copies, in_files = parameter_files.write_changed(
            _share(install, request.ros_name),
            # Where a sandbox's mounts come from can be read in it: this path must not name the trial.
            Path(request.out).parent / f"config-{request.domain_id}-{os.getpid()}",
            course.telltales,
            plan.params_file or "*.yaml",
        )
        visible |= {copy: f"{_share(building.INSTALL, request.ros_name)}/{name}" for copy, name in copies.items()}
    if plan.launch:
        visible |= {_ROS2: "/ws/ros2"}
    if plan.namespace:
        visible |= {course.path("trials/launch"): "/ws/launch"}
    environment = node_environment() | {"ROS_DOMAIN_ID": str(request.domain_id)}
    return sandbox.Sandbox(visible, environment=environment, network=True, pipes=(notes.pipe,)), in_files


def _readers(install: Path, course: Course) -> dict[str, Reader]:
    """Return by topic how to read the messages of a type whose fields the submission has in its own order."""
    published = {topic: t for node in course.nodes.values() for topic, t in node.publishes.items()}
    own = {topic: type_ for topic, type_ in published.items() if type_ in course.interfaces}
    texts = {topic: building.interface_text(install, type_, own_package(type_)) for topic, type_ in own.items()}
    found = {topic: reader(text, interface(own[topic])) for topic, text in texts.items()}
    return {topic: read for topic, read in found.items() if read}


def _missing(plan: TrialPlan, install: Path, package: str) -> Reason | None:
    """Return what the trial needs and the package has not installed, None if nothing is missing."""
    own_launch = bool(plan.launch and not plan.namespace)
    if not own_launch and not (install / "lib" / package / plan.node).is_file():
        return Reason(Kind.NO_PROGRAM, plan.node, package)
    file = f"launch/{plan.launch}" if own_launch else plan.params_file and f"config/{plan.params_file}"
    there = not file or building.shared_file(_share(install, package), file)
    return None if there else Reason(Kind.NO_FILE, file, package)


def _share(install: Path, package: str) -> Path:
    return install / "share" / package


def _transformed_world(course: Course, plan: TrialPlan, seed: int, at: Pose | None = None) -> World:
    """Return the trial's world turned, mirrored and shifted by the seed, so that memorising places does not help.

    With `at` it is turned and shifted so that the robot starts there. That of a case is turned as the case says.
    """
    if plan.case:
        return load_world(course.world(plan.world)).transformed(rotate=math.radians(plan.case.get("heading", 0.0)))
    rng = random.Random(f"{seed}:{plan.name}:world")
    world = load_world(course.world(plan.world)).transformed(
        rotate=rng.uniform(-math.pi, math.pi),
        mirror=rng.random() < 0.5,
        shift=(rng.uniform(-5.0, 5.0), rng.uniform(-5.0, 5.0)),
    )
    if at is None:
        return world
    turned = world.transformed(rotate=at.yaw - world.start.yaw)
    return turned.transformed(shift=(at.x - turned.start.x, at.y - turned.start.y))


def _command(plan: TrialPlan, install: Path, package: str) -> list[str]:
    if plan.launch:
        if plan.namespace:
            return [*LAUNCH, f"/ws/launch/{plan.launch}", f"package:={package}"]
        file = _in_sandbox(install, package, f"launch/{plan.launch}")
        given = [] if plan.use_sim_time is None else [f"use_sim_time:={_parameter(plan.use_sim_time)}"]
        return [*LAUNCH, file, *given]
    command = _node_command(package, plan.node, plan.remappings)
    if plan.params_file:
        command += ["--params-file", _in_sandbox(install, package, f"config/{plan.params_file}")]
    for name, value in plan.parameters.items():
        command += ["-p", f"{name}:={_parameter(value)}"]
    return command


def _in_sandbox(install: Path, package: str, path: str) -> str:
    """Return where the sandbox has a file of the package's share folder; `_missing` has said that it is there."""
    return f"{_share(building.INSTALL, package)}/{building.shared_file(_share(install, package), path)}"


def _node_command(package: str, executable: str, remappings: Mapping[str, str]) -> list[str]:
    command = [f"{building.INSTALL}/lib/{package}/{executable}", "--ros-args", "-p", "use_sim_time:=true"]
    for name, new in remappings.items():
        command += ["-r", f"{name}:={new}"]
    return command


def _parameter(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


if __name__ == "__main__":
    sys.exit(main())
