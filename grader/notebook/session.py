"""A session with one node of the student's and a simulated robot, in lockstep inside the notebook's kernel.

The node is a process of its own, the robot and the clock are here. Both keep to the workspace's DDS domain, so `!ros2`
in a cell sees what is seen here. Times are simulated seconds since the session began.
"""

from __future__ import annotations

import math
import os
import threading
import time
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace, TracebackType
from typing import TYPE_CHECKING, Any, Self

from grader import build
from grader.contract import spec
from grader.errors import KitError
from grader.host import ros_env
from grader.notebook import interface_types, prerequisites
from grader.notebook.node_process import NodeProcess
from grader.notebook.workspace import NOTEBOOK, Workspace, discovery_range, prepare
from sim import PROFILES, Pose, Recorder, Recording, Simulator, World, load_world

if TYPE_CHECKING:
    from grader.notebook.watched_stage import WatchedStage
    from sim.live import Live

TICK_S = 0.05  # 20 Hz, as in sim.bridge, which cannot be imported without ROS
_HEARD = ("cmd_vel", "sensor_fusion_data", "obstacle_distance")
_NO_ACTION = "no node offers the action navigate_to_position"


@dataclass(frozen=True, repr=False)
class Went:
    """How a drive to a place ended.

    `status` is "succeeded", "canceled", "aborted", "rejected", "unfinished" or "no server"; `feedback` holds
    (t, metres to go).
    """

    status: str
    success: bool
    final_pose: Any
    feedback: list[tuple[float, float]] = field(default_factory=list)

    def __repr__(self) -> str:
        place = self.final_pose.position
        told = f"{len(self.feedback)} feedback messages"
        return f"Went({self.status!r}, success={self.success}, final_pose at ({place.x:.2f}, {place.y:.2f}), {told})"


@dataclass(frozen=True)
class Ended:
    """How a node ended after Ctrl-C: wall seconds, exit code (None: it had to be killed), the last cmd_vel or None."""

    seconds: float
    exit_code: int | None
    last_command: Any


class Run:
    """A node that runs beside a simulated robot. Close it, or use it in a `with` block.

    Attributes:
        simulator: the robot and its world; change it between two calls as you like.
        node: the node's name; `trouble` says why there is none that works, "" if it does.
    """

    def __init__(
        self,
        workspace: Workspace,
        node: str,
        world: str | World,
        *,
        seed: int,
        parameters: Mapping[str, object],
        remappings: Mapping[str, str],
        profile: str,
    ) -> None:
        self.node = node
        self.trouble = ""
        self._workspace = workspace
        self._parameters, self._remappings = dict(parameters), dict(remappings)
        self.simulator = Simulator(load_world(world) if isinstance(world, str) else world, PROFILES[profile], seed=seed)
        self._lock = threading.RLock()  # a live view's thread and a cell
        self._stage: WatchedStage | None = None
        self._process: NodeProcess | None = None
        self._heard: Mapping[str, list[tuple[float, Any]]] = {}
        self._live: weakref.ref[Live] | None = None
        self._output = ""
        self._closed = False
        self._begin()

    # ------------------------------------------------------------- time

    @property
    def t(self) -> float:
        """Return the simulated time since the session began, in seconds."""
        return self.simulator.time

    def drive(self, seconds: float, until: Callable[[], object] | None = None) -> Recording:
        """Let simulated time pass, at most until `until()` is true, and return everything recorded so far."""
        for _ in range(max(1, round(seconds / TICK_S))):
            self._tick()
            if until is not None and until():
                break
        return self.recording

    @property
    def recording(self) -> Recording:
        """Return what has happened since the session began."""
        with self._lock:
            return self._recorder.recording()

    def live(self, **options: Any) -> Live:
        """Return a live view of the run. A click on the map sends the node a goal; `options` are those of Live."""
        from sim.live import Live

        self._stop_view()
        view = Live(self.simulator, step=lambda _dt: self._tick(), on_goal=self._click, on_reset=self._again, **options)
        self._live = weakref.ref(view)
        return view

    # ------------------------------------------------------------- what a client can ask

    def set_speed(self, speed: float) -> Any:
        """Call set_speed and return its response: `.success` and `.message`."""
        answer, why = self._call("set_speed", speed=float(speed))
        return answer or SimpleNamespace(success=False, message=why)

    def status(self) -> Any:
        """Call get_status and return its response: `.speed`, `.obstacle_detected`, `.pose` and `.status`."""
        answer, why = self._call("get_status")
        return answer or SimpleNamespace(speed=math.nan, obstacle_detected=False, pose=_pose(), status=why)

    def go_to(
        self, x: float, y: float, tolerance: float = 0.1, cancel_after: float | None = None, limit: float = 60.0
    ) -> Went:
        """Send a goal (m, odom frame), let time pass until it ends, and return how it went.

        Asks to cancel it after `cancel_after` simulated seconds, and gives up after `limit`.
        """
        with self._lock:
            stage = self._working()
            if stage is None or not stage.takes_goals:
                print(f"not yet: {_NO_ACTION}")
                return Went("no server", False, _pose())
            goal = stage.navigate(x, y, tolerance)
        begin, canceled = self.t, False
        while not (goal.ended or goal.problem) and self.t < begin + limit - 1e-9 and self._working():
            if cancel_after is not None and not canceled and self.t >= begin + cancel_after - 1e-9:
                goal.cancel()
                canceled = True
            self._tick()
        if goal.problem:
            print(f"not yet: {goal.problem}")
        facts, result = goal.facts(), goal.result
        return Went(
            status=facts.status,
            success=bool(facts.success),
            final_pose=result.final_pose if result is not None else _pose(),
            feedback=[(t, told) for t, told, _ in facts.feedback],
        )

    def set_parameter(self, name: str, value: object) -> tuple[bool, str]:
        """Set a parameter of the running node; return whether it took it, and its reason if not."""
        with self._lock:
            stage = self._working()
            if stage is None:
                return False, "there is no node"
            answer = stage.set_parameter(name, value)
        return bool(answer.accepted), answer.reason

    def messages(self, topic: str) -> list[tuple[float, Any]]:
        """Return (t, message) of all that came on cmd_vel, sensor_fusion_data or obstacle_distance.

        Raises:
            KeyError: another topic.
        """
        if topic not in _HEARD:
            raise KeyError(f"messages of {topic!r} are not kept; those of {', '.join(_HEARD)} are")
        return list(self._heard.get(topic, ()))

    # ------------------------------------------------------------- the end

    def interrupt(self) -> Ended:
        """Press Ctrl-C: send the node SIGINT, wait for its end, and return how it ended. The session is over then."""
        with self._lock:
            stage, process = self._working(), self._process
            if stage is None or process is None:
                return Ended(0.0, None, None)
            started = time.monotonic()
            stage.interrupt()
            seconds = stage.choices.get("seconds_to_end", round(time.monotonic() - started, 2))
            code, heard = process.exit_code(), self._heard["cmd_vel"]
        self.close()
        return Ended(seconds, code, heard[-1][1] if heard else None)

    @property
    def output(self) -> str:
        """Return what the node has printed."""
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

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = f"not yet: {self.trouble}" if self.trouble else "is over" if self._closed else "runs"
        return f"Run({self.node} in {self.simulator.world.name!r}: {state})"

    # ------------------------------------------------------------- inside

    def _begin(self) -> None:
        """Start the node and meet it on the graph; without one the robot stands."""
        self._recorder = Recorder(self.simulator)
        install = self._install()
        if install is None:
            return
        interface_types.load(self._workspace)
        from grader.notebook.watched_stage import TrialOver, WatchedStage

        self._process = process = NodeProcess(self._command(install), self._environment(install))
        self._stage = WatchedStage(
            self.node, self.simulator, process, domain_id=self._workspace.domain_id, remappings=self._remappings,
            recorder=self._recorder,
        )  # fmt: skip
        self._heard = self._stage.heard
        # For a run that nobody holds any more; at the kernel's end the processes are seen to by themselves.
        self._finish = weakref.finalize(self, _finish, process, self._stage)
        self._finish.atexit = False
        try:
            self._stage.open()
        except TrialOver as over:
            self._give_up(f"{over}{_last_words(process)}")

    def _install(self) -> Path | None:
        """Build the package and return where it is installed; say what is missing and return None if it cannot be."""
        requirement = "F1" if self.node == "robot_controller" else "F13"
        gap = prerequisites.first_gap(self._workspace.package, requirement, os.environ.get(NOTEBOOK, ""))
        if gap is not None:
            self._give_up(f"{gap.seen}; {gap.try_}")
            return None
        try:
            built = build.build([self._workspace.package], build.cache_folder())
        except KitError as error:
            self._give_up(str(error))
            return None
        if not built.facts.ok:
            self._give_up(f"the package does not build: {prerequisites.first_error(built.facts)}")
            return None
        if self.node not in built.facts.executables:
            self._give_up(f"the package installs no executable {self.node} in lib/{spec.PACKAGE}")
            return None
        return built.install

    def _environment(self, install: Path) -> dict[str, str]:
        return ros_env.environment(install, home=Path.home()) | {
            "ROS_DOMAIN_ID": str(self._workspace.domain_id),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": discovery_range(),
            "ROS_LOG_DIR": str(self._workspace.root / "log" / "ros"),
        }

    def _command(self, install: Path) -> list[str]:
        words = [str(install / "lib" / spec.PACKAGE / self.node), "--ros-args", "-p", "use_sim_time:=true"]
        for name, value in self._parameters.items():
            words += ["-p", f"{name}:={str(value).lower() if isinstance(value, bool) else value}"]
        for name, new in self._remappings.items():
            words += ["-r", f"{name}:={new}"]
        return words

    def _tick(self) -> None:
        with self._lock:
            stage = self._working()
            if stage is not None:
                from grader.notebook.watched_stage import TrialOver

                try:
                    stage.tick()
                    return
                except TrialOver as over:  # before the tick: the robot stands from here on
                    self.simulator.command(0.0, 0.0)
                    self._give_up(f"{over}{_last_words(self._process)}")
            self._recorder.take(self.simulator.step(TICK_S))

    def _working(self) -> WatchedStage | None:
        """Return the stage while its node is there."""
        return self._stage if self._process is not None and not self.trouble else None

    def _call(self, service: str, **fields: object) -> tuple[Any, str]:
        """Return a service's response, or None and why there was none."""
        with self._lock:
            stage = self._working()
            return (None, f"no node offers {service}") if stage is None else stage.ask(service, fields)

    def _click(self, x: float, y: float) -> str:
        """Send the goal that was clicked, map frame, and say what came of it."""
        with self._lock:
            stage = self._working()
            if stage is None or not stage.takes_goals:
                return _NO_ACTION
            place = self.simulator.odom_origin.inverse().compose(Pose(x, y, 0.0))
            goal = stage.navigate(place.x, place.y, 0.1)
        if goal.accepted:
            return f"goal sent: ({x:z.2f}, {y:z.2f}) m"
        return goal.problem or "the node rejected the goal"

    def _again(self) -> None:
        """Start the node anew after the simulator was set back: for a node time does not go back."""
        with self._lock:
            self._end()
            self.trouble = ""
            self._begin()

    def _give_up(self, why: str) -> None:
        self.trouble = why
        print(f"not yet: {why}")
        self._end()

    def _end(self) -> None:
        process, self._process, self._stage = self._process, None, None
        if process is not None:
            self._finish()  # at most once, whoever comes first
            self._output = process.output

    def _stop_view(self) -> None:
        view = self._live() if self._live is not None else None
        self._live = None
        if view is not None:
            view.stop()


def _finish(process: NodeProcess, stage: WatchedStage) -> None:
    process.kill()
    stage.close()


def _last_words(process: NodeProcess | None) -> str:
    """Return the last line that a node which has ended by itself had printed."""
    return f"; its last words: {process.last_words}" if process is not None and process.last_words else ""


def _pose() -> Any:
    from geometry_msgs.msg import Pose

    return Pose()


# -- one session a node -----------------------------------------------------------------------------------------------

_RUNS: weakref.WeakValueDictionary[str, Run] = weakref.WeakValueDictionary()


def start(workspace: Workspace, node: str, world: str | World, **options: Any) -> Run:
    """Return a new session with a node; an older one with the same node is closed first."""
    prepare(workspace, os.environ)
    older = _RUNS.get(node)
    if older is not None:
        older.close()
    run = Run(workspace, node, world, **options)
    _RUNS[node] = run
    return run
