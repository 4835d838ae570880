"""Run one of the student's nodes beside a simulated robot, in lockstep, inside the notebook's kernel.

The node is a separate process; the robot and the clock live in the kernel. Both use the workspace's DDS domain, so
`!ros2` in a cell sees the same graph. Times are simulated seconds since the run began.
"""

from __future__ import annotations

import math
import os
import threading
import time
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Self

from grader import building
from grader.checks.first_cause import holding_on
from grader.course import definition
from grader.errors import KitError
from grader.evidence import Kind, Reason
from grader.host import ros_env
from grader.notebook import interface_types, node_process
from grader.notebook.feedback import Progress
from grader.notebook.node_process import NodeProcess
from grader.notebook.workspace import Workspace, course, prepare
from grader.tracebacks import last_words
from grader.words import mark, say
from sim import Pose, Recorder, Recording, Simulator, World, load_world
from sim.recording import THRESHOLDS_NOTE

if TYPE_CHECKING:
    from grader.notebook.watched_stage import WatchedStage
    from sim.live import Live

TICK_S = 0.05  # 20 Hz, as in sim.bridge, which cannot be imported without ROS
_FIRST_TIME = mark("; the first time takes about a minute where it has interfaces, longer on a busy machine")


@dataclass(frozen=True, repr=False)
class GoalResult:
    """The end of a goal.

    `status` is "succeeded", "canceled", "aborted", "rejected", "unfinished" or "no server"; `feedback` holds
    (t, metres to go), `place` the pose in the result.
    """

    status: str
    success: bool
    place: Any
    feedback: list[tuple[float, float]] = field(default_factory=list)

    def __repr__(self) -> str:
        at, fields, count = self.place.position, course().goal, len(self.feedback)
        place_shown = f"{fields.final if fields else 'place'} at ({at.x:.2f}, {at.y:.2f})"
        return f"GoalResult({self.status!r}, success={self.success}, {place_shown}, {count} feedback messages)"


@dataclass(frozen=True)
class NodeExit:
    """The end of a node after Ctrl-C: wall seconds, exit code (None if it had to be killed), last command or None."""

    seconds: float
    exit_code: int | None
    last_command: Any


class Run:
    """A node that runs beside a simulated robot. Close it after use, or use it in a `with` block.

    Attributes:
        simulator: the robot and its world; free to be changed between two calls.
        node: the node's name.
        trouble: why the node does not work, "" if it does.
    """

    def __init__(
        self,
        workspace: Workspace,
        node: str,
        world: str | World,
        *,
        program: str = "",
        launch: str = "",
        parameters: Mapping[str, object] | None = None,
    ) -> None:
        self.node = node
        self.trouble = ""
        self._workspace = workspace
        self._program, self._launch = program, launch
        self._parameters = dict(parameters or {})
        # Not by the world's own seed: the published notebooks show runs with this one.
        self.simulator = Simulator(load_world(course().world(world)) if isinstance(world, str) else world, seed=0)
        self._lock = threading.RLock()  # a live view's thread and a cell
        self._stage: WatchedStage | None = None  # while the node runs
        self._process: NodeProcess | None = None
        self._recorded: dict[str, list[tuple[float, Any]]] = {}
        self._live: weakref.ref[Live] | None = None
        self._output = ""
        self._closed = False
        self._built_at = 0.0
        self._begin()

    # ------------------------------------------------------------- time

    @property
    def t(self) -> float:
        """Return the simulated time since the run began, in seconds."""
        return self.simulator.time

    def drive(self, seconds: float, until: Callable[[], object] | None = None) -> Recording:
        """Let simulated time pass, `seconds` or until `until()` is true, and return everything recorded so far."""
        sources = self._workspace.package.rglob("*.py") if self._process is not None else ()
        if any(path.stat().st_mtime > self._built_at for path in sources):
            self._built_at = time.time()
            words = mark(
                "your package has changed since this run began, and the node is still the old one; call run_node again"
            )
            print(say(words))
        for _ in range(max(1, round(seconds / TICK_S))):
            self._tick()
            if until is not None and until():
                break
        return self.recording

    @property
    def recording(self) -> Recording:
        """Return everything recorded since the run began."""
        with self._lock:
            return self._recorder.recording()

    def live(self, **options: Any) -> Live:
        """Return a live view of the run. A click on the map sends the node a goal; `options` are those of Live."""
        from sim.live import Live

        self._stop_view()
        view = Live(
            self.simulator, step=lambda _dt: self._tick(), on_goal=self._click, on_reset=self._restart, **options
        )
        self._live = weakref.ref(view)
        return view

    # ------------------------------------------------------------- client calls

    def __getattr__(self, name: str) -> Any:
        """Return a function that calls one of the contract's services, by its name with or without "get_"."""
        services = {} if name.startswith("_") else _services()
        service = next((service for service in services if name in (service, service.removeprefix("get_"))), None)
        if service is None:
            words = mark("a run has no {name}; its services are {services}")
            raise AttributeError(say(words, name=name, services=", ".join(services)))
        return partial(self.call, service)

    def call(self, service: str, *values: object, **fields: object) -> Any:
        """Call a service and return its response. The values are those of the request's fields, in their order.

        Without an answer, the response says in its text why there is none.
        """
        kind = _services()[service]
        request, response = definition.parts(interface_types.text(kind))
        given = dict(zip(request, values, strict=False)) | fields
        typed = {name: float(v) if request[name].startswith("float") else v for name, v in given.items()}  # type: ignore[arg-type]
        nobody = say("no node offers {service}", service=service) if self._stage is None else ""
        answer, why = self._asked(lambda stage: stage.ask(service, typed)) or (None, nobody or self.trouble)
        return answer or SimpleNamespace(**{name: _blank(type_, why) for name, type_ in response.items()})

    def go_to(
        self, x: float, y: float, tolerance: float = 0.1, cancel_after: float | None = None, limit: float = 60.0
    ) -> GoalResult:
        """Send a goal (m, odom frame), let time pass until it ends, and return its result.

        Cancels the goal after `cancel_after` simulated seconds, and gives up after `limit`.
        """
        goal = self._send(x, y, tolerance)
        if isinstance(goal, str):
            if goal != self.trouble:  # which was printed when it came
                print(say("not yet: {no_action}", no_action=goal))
            return GoalResult("no server", False, _pose())
        begin, canceled = self.t, False
        while not (goal.ended or goal.problem) and self.t < begin + limit - 1e-9 and self._stage:
            if cancel_after is not None and not canceled and self.t >= begin + cancel_after - 1e-9:
                with self._lock:
                    goal.cancel()
                canceled = True
            self._tick()
        if goal.problem:
            print(say("not yet: {goal.problem}", goal=goal))
        facts, result = goal.facts(), goal.result
        return GoalResult(
            status=facts.status,
            success=bool(facts.success),
            place=_pose() if result is None or (fields := course().goal) is None else getattr(result, fields.final),
            feedback=[(t, remaining) for t, remaining, _ in facts.feedback],
        )

    def set_parameter(self, name: str, value: object) -> tuple[bool, str]:
        """Set a parameter of the running node; return whether it was accepted, and the node's reason if not."""
        nobody = say("there is no node") if self._stage is None else ""
        answer = self._asked(lambda stage: stage.set_parameter(name, value))
        return (False, nobody or self.trouble) if answer is None else (bool(answer.accepted), answer.reason)

    def messages(self, topic: str) -> list[tuple[float, Any]]:
        """Return (t, message) for each message on a topic that the contract's nodes publish.

        Raises:
            KeyError: the topic is not recorded.
        """
        if topic not in self._recorded:
            words = mark("messages on {topic!r} are not recorded; those on {published} are")
            raise KeyError(say(words, topic=topic, published=", ".join(self._recorded)))
        return list(self._recorded[topic])

    # ------------------------------------------------------------- the end

    def interrupt(self) -> NodeExit:
        """Press Ctrl-C: send the node SIGINT, wait for its end and describe it. This closes the run."""
        with self._lock:
            stage, process = self._stage, self._process
            if stage is None or process is None:
                return NodeExit(0.0, None, None)
            started = time.monotonic()
            stage.interrupt()
            seconds = stage.measured.get("seconds_to_end", round(time.monotonic() - started, 2))
            code, commands = process.exit_code(), self._recorded.get(course().nodes[self.node].command, ())
        self.close()
        return NodeExit(seconds, code, commands[-1][1] if commands else None)

    @property
    def output(self) -> str:
        """Return the node's output so far."""
        return self._process.output if self._process is not None else self._output

    def close(self) -> None:
        """Stop the node and leave the graph. Can be called again."""
        self._stop_view()
        with self._lock:
            self._end()
            self._closed = True
        if _RUNS.get(self.node) is self:
            _RUNS.pop(self.node, None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        state = say("closed") if self._closed else say("running")
        if self.trouble:
            state = say("not yet: {trouble}", trouble=self.trouble)
        return f"Run({self.node} in {self.simulator.world.name!r}: {state})"

    # ------------------------------------------------------------- inside

    def _begin(self) -> None:
        """Build and start the node, and wait until it is on the graph; without one the robot stands still."""
        self._recorder, self._built_at = Recorder(self.simulator), time.time()
        drawn = [node.thresholds(self._parameters) for node in course().nodes.values()]
        self._recorder.notes[THRESHOLDS_NOTE] = {name: value for each in drawn for name, value in each.items()}
        self._recorded = {topic: [] for node in course().nodes.values() for topic in node.publishes}
        with Progress() as progress:
            self._start_node(progress)

    def _start_node(self, progress: Progress) -> None:
        contract_is_built = building.contract_is_built(building.cache_folder(), course())
        try:
            progress.say(say("building your package") + ("" if contract_is_built else say(_FIRST_TIME)))
            install = node_process.install(self._workspace, self.node, progress.more)
        except KitError as error:
            self._give_up(str(error))
            return
        if not contract_is_built:
            progress.say(say(building.FIRST_TIME))
        interface_types.load(self._workspace, progress.more)
        progress.say(say("starting {node}", node=self.node))
        from grader.notebook.watched_stage import WatchedStage

        command = node_process.command(install, self.node, self._program, self._launch, self._parameters)
        environment = ros_env.environment(install, home=Path.home()) | self._workspace.variables
        # A node that hangs can then tell where.
        self._process = process = NodeProcess(command, environment | {"PYTHONFAULTHANDLER": "1"})
        self._stage = WatchedStage(
            course(), self.node, self.simulator, process,
            launch=self._launch, domain_id=self._workspace.domain_id,
            recorder=self._recorder, messages=self._recorded, package=self._workspace.package,
        )  # fmt: skip
        # For a run without references to it; when the kernel ends, the processes end by themselves.
        self._finish = weakref.finalize(self, _finish, process, self._stage)
        self._finish.atexit = False
        self._asked(lambda stage: stage.open())
        # In the clinic learners are to find that out themselves.
        if self._stage is not None and not self._workspace.is_linked and (deaf_to := self._stage.deaf_to()):
            print(deaf_to)

    def _tick(self) -> None:
        with self._lock:
            self._asked(lambda stage: stage.run(TICK_S))
            if self._stage is None:
                self._recorder.take(self.simulator.step(TICK_S))

    def _asked(self, question: Callable[[WatchedStage], Any]) -> Any:
        """Return what `question` returns; None if there is no node, or it has ended: then the robot stands still."""
        with self._lock:
            if (stage := self._stage) is None:
                return None
            from grader.notebook.watched_stage import TrialOver

            try:
                return question(stage)
            except TrialOver as over:
                self.simulator.command(0.0, 0.0)
                self._give_up(self._why(over.reason))
                return None

    def _click(self, x: float, y: float) -> str:
        """Send the clicked place (m, map frame) as a goal, and return in words whether the node accepted it."""
        place = self.simulator.odom_origin.inverse().compose(Pose(x, y, 0.0))
        goal = self._send(place.x, place.y, 0.1)
        if isinstance(goal, str):
            return goal
        if goal.accepted:
            return say("goal sent: ({x:z.2f}, {y:z.2f}) m", x=x, y=y)
        return str(goal.problem or say("the node rejected the goal"))

    def _send(self, x: float, y: float, tolerance: float) -> Any:
        """Send a goal (m, odom frame) and return it, or why there is none."""
        with self._lock:
            stage = self._stage
            if stage is None or not stage.takes_goals:
                names = [name for node in course().nodes.values() for name in node.actions]
                return say("no node offers the action {names}", names=" or ".join(names))
            return self._asked(lambda stage: stage.navigate(x, y, tolerance)) or self.trouble

    def _restart(self) -> None:
        """Start the node anew after the simulator was reset: in a node, time must not go back."""
        with self._lock:
            self._end()
            self.trouble = ""
            self._begin()

    def _give_up(self, why: str) -> None:
        self.trouble = why
        print(say("not yet: {why}", why=why))
        self._end()

    def _why(self, ended: Reason) -> str:
        """Return why a run is over, with the line that holds a deaf node up, or with the last words of another."""
        if ended.kind is not Kind.HANGS:
            process = self._process
            said = last_words(process.output) if process is not None and process.exit_code() is not None else ""
            return f"{ended}" + (say("; its last output: {said}", said=said) if said else "")
        from grader.quality.source import analyse_package

        text = analyse_package(self._workspace.package, course(), lint=False)
        return f"{ended}{holding_on(text.habits)}"

    def _end(self) -> None:
        process, self._process, self._stage = self._process, None, None
        if process is not None:
            self._finish()  # runs at most once
            self._output = process.output

    def _stop_view(self) -> None:
        view = self._live() if self._live is not None else None
        self._live = None
        if view is not None:
            view.stop()


def _finish(process: NodeProcess, stage: WatchedStage) -> None:
    process.kill()
    stage.close()


def _services() -> dict[str, str]:
    """Return the services of the contract's nodes with their types."""
    return {name: type_ for node in course().nodes.values() for name, type_ in node.services.items()}


def _blank(type_: str, why: str) -> Any:
    """Return the value of a field in place of an answer that did not come; a text says why."""
    return _pose() if type_ == "geometry_msgs/Pose" else {"bool": False, "string": why}.get(type_, math.nan)


def _pose() -> Any:
    from geometry_msgs.msg import Pose

    return Pose()


# -- one run for each node ---------------------------------------------------------------------------------------------

_RUNS: weakref.WeakValueDictionary[str, Run] = weakref.WeakValueDictionary()


def start(workspace: Workspace, node: str, world: str | World, **options: Any) -> Run:
    """Return a new run of a node; an older run of the same node is closed first."""
    prepare(workspace, os.environ)
    if older := _RUNS.get(node):
        older.close()
    _RUNS[node] = run = Run(workspace, node, world, **options)
    return run
