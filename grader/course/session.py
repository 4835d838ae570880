"""A session with one node of the student's and a simulated robot, in lockstep inside the notebook's kernel.

The node is a process of its own, the robot and the clock are here. Both keep to the workspace's DDS domain, so `!ros2`
in a cell sees what is seen here. Times are simulated seconds since the session began.
"""

from __future__ import annotations

import atexit
import ctypes
import importlib
import math
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace, TracebackType
from typing import TYPE_CHECKING, Any, Self

from grader import build, toolchain
from grader.course import needs
from grader.course.workspace import NOTEBOOK, Workspace
from grader.errors import GraderError, SubmissionError
from grader.trials.catalog import TrialPlan
from sim import PROFILES, Recorder, Recording, Simulator, World, load_world
from sim.sensors import Reading

if TYPE_CHECKING:
    from grader.trials.stage import Stage
    from sim.live import Live

_TICK_S = 0.05
_UP_WITHIN_S = 20.0
_KILL_AFTER_S = 3.0
_OUTPUT_CAP = 200_000
_TOPICS = ("cmd_vel", "sensor_fusion_data", "obstacle_distance")


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
        self._stage: Stage | None = None
        self._process: _NodeProcess | None = None
        self._messages: dict[str, list[tuple[float, Any]]] = {name: [] for name in _TOPICS}
        self._live: weakref.ref[Live] | None = None
        self._output = ""
        self._begin()

    # ------------------------------------------------------------- time

    @property
    def t(self) -> float:
        """Return the simulated time since the session began, in seconds."""
        return self.simulator.time

    def drive(self, seconds: float, until: Callable[[], object] | None = None) -> Recording:
        """Let simulated time pass, at most until `until()` is true, and return everything recorded so far."""
        for _ in range(max(1, round(seconds / _TICK_S))):
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

        view = Live(self.simulator, step=lambda _dt: self._tick(), on_goal=self._click, on_reset=self._again, **options)
        self._live = weakref.ref(view)
        return view

    # ------------------------------------------------------------- what a client can ask

    def set_speed(self, speed: float) -> Any:
        """Call set_speed and return its response: `.success` and `.message`."""
        return self._call("set_speed", speed=float(speed)) or SimpleNamespace(success=False, message=self._silence)

    def status(self) -> Any:
        """Call get_status and return its response: `.speed`, `.obstacle_detected`, `.pose` and `.status`."""
        answer = self._call("get_status")
        if answer is not None:
            return answer
        return SimpleNamespace(speed=math.nan, obstacle_detected=False, pose=_pose(), status=self._silence)

    def go_to(
        self, x: float, y: float, tolerance: float = 0.1, cancel_after: float | None = None, limit: float = 60.0
    ) -> Went:
        """Send a goal (m, odom frame), let time pass until it ends, and return how it went.

        Asks to cancel it after `cancel_after` simulated seconds, and gives up after `limit`.
        """
        with self._lock:
            stage = self._stage
            if stage is None or not self._alive() or not stage.action or not stage.action.server_is_ready():
                self._tell("no node offers the action navigate_to_position")
                return Went("no server", False, _pose())
            goal = stage.navigate(x, y, tolerance)
        begin, canceled = self.t, False
        while not goal.ended and self.t < begin + limit - 1e-9 and self._alive():
            if cancel_after is not None and not canceled and self.t >= begin + cancel_after - 1e-9:
                goal.cancel()
                canceled = True
            self._tick()
        facts = goal.facts()
        result = goal._result.result if goal._result is not None else None
        return Went(
            status="rejected" if facts.status == "rejected" else facts.status,
            success=bool(facts.success),
            final_pose=result.final_pose if result is not None else _pose(),
            feedback=[(t, told) for t, told, _ in facts.feedback],
        )

    def set_parameter(self, name: str, value: object) -> tuple[bool, str]:
        """Set a parameter of the running node; return whether it took it, and its reason if not."""
        with self._lock:
            if self._stage is None or not self._alive():
                return False, "there is no node"
            answer = self._stage.set_parameter(name, value)
        return bool(answer.accepted), answer.reason

    def messages(self, topic: str) -> list[tuple[float, Any]]:
        """Return (t, message) of everything that came on cmd_vel, sensor_fusion_data or obstacle_distance.

        Raises:
            KeyError: another topic.
        """
        return list(self._messages[topic])

    # ------------------------------------------------------------- the end

    def interrupt(self) -> Ended:
        """Press Ctrl-C: send the node SIGINT, wait for its end, and return how it ended. The session is over then."""
        with self._lock:
            if self._stage is None or self._process is None or not self._alive():
                return Ended(0.0, None if self._process is None else self._process.exit_code(), None)
            started = time.monotonic()
            self._stage.interrupt()
            seconds = self._stage.choices.get("seconds_to_end", time.monotonic() - started)
            ended = Ended(seconds, self._process.exit_code(), self._last_command())
        self.close()
        return ended

    @property
    def output(self) -> str:
        """Return what the node has printed."""
        return self._process.output if self._process is not None else self._output

    def close(self) -> None:
        """Stop the node and leave the graph. Can be called again."""
        view = self._live() if self._live is not None else None
        if view is not None:
            view.stop()
        with self._lock:
            self._end()
        if _RUNS.get(self.node) is self:
            del _RUNS[self.node]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = f"not yet: {self.trouble}" if self.trouble else "runs" if self._alive() else "has ended"
        return f"{self.node} in {self.simulator.world.name!r}: {state}"

    # ------------------------------------------------------------- inside

    def _begin(self) -> None:
        """Start the node and meet it on the graph; without one the robot stands."""
        self._recorder = Recorder(self.simulator)
        self._readings: list[Reading] = []
        install = self._install()
        if install is None:
            return
        types(self._workspace)
        from grader.trials.stage import Stage, TrialOver

        environment = toolchain.environment(install, home=Path.home()) | {
            "ROS_DOMAIN_ID": str(self._workspace.domain_id),
            "ROS_LOG_DIR": str(self._workspace.root / "log" / "ros"),
        }
        self._process = process = _NodeProcess(self._command(install), environment)
        weakref.finalize(self, process.kill)
        plan = TrialPlan(
            "notebook", "", lambda _stage: None, self.node, self.simulator.world.name, (), self._parameters,
            remappings=self._remappings,
        )  # fmt: skip
        stage = Stage(plan, self.simulator.seed, self.simulator, process, self._workspace.domain_id)  # type: ignore[arg-type]  # it has the methods of a walled-in process
        stage._wall_limit = math.inf
        self._stage = stage
        self._listen(stage)
        try:
            stage.open()
        except TrialOver as over:
            self._give_up(_plain(str(over), process))

    def _install(self) -> Path | None:
        """Build the package and return where it is installed; say what is missing and return None if it cannot be."""
        requirement = "F1" if self.node == "robot_controller" else "F13"
        gap = needs.first_gap(self._workspace.package, requirement, os.environ.get(NOTEBOOK, ""))
        if gap is not None:
            self._give_up(gap.seen)
            return None
        try:
            built = build.build([self._workspace.package], build.cache_folder())
        except (SubmissionError, GraderError) as error:
            self._give_up(str(error))
            return None
        if not built.facts.ok:
            self._give_up(f"the package does not build: {needs.first_error(built.facts)}")
            return None
        if self.node not in built.facts.executables:
            self._give_up(f"the package installs no executable {self.node} in lib/{build.PACKAGE}")
            return None
        return built.install

    def _command(self, install: Path) -> list[str]:
        words = [str(install / "lib" / build.PACKAGE / self.node), "--ros-args", "-p", "use_sim_time:=true"]
        for name, value in self._parameters.items():
            words += ["-p", f"{name}:={str(value).lower() if isinstance(value, bool) else value}"]
        for name, new in self._remappings.items():
            words += ["-r", f"{name}:={new}"]
        return words

    def _listen(self, stage: Stage) -> None:
        from std_msgs.msg import Float32

        from grader.trials.types import SensorFusionData

        published, commanded = stage.bridge.on_published, stage.bridge.on_command

        def take_reading(reading: Reading) -> None:
            self._readings.append(reading)
            published(reading)

        def take_command(t: float, message: Any) -> None:
            self._messages["cmd_vel"].append((t, message))
            commanded(t, message)

        def keep(topic: str) -> Callable[[Any], None]:
            return lambda message: self._messages[topic].append((stage.t, message))

        stage.bridge.on_published, stage.bridge.on_command = take_reading, take_command
        if self.node == "sensor_processor":
            for kind, topic in ((SensorFusionData, "sensor_fusion_data"), (Float32, "obstacle_distance")):
                stage.bridge.node.create_subscription(kind, topic, keep(topic), 10)

    def _tick(self) -> None:
        with self._lock:
            if self._stage is not None and self._alive():
                from grader.trials.stage import TrialOver

                with suppress(TrialOver):  # it has just ended: noticed before the next step
                    self._stage._tick()
            else:
                if self._stage is not None and not self.trouble:
                    self.trouble = "the node has ended"
                    self._tell(f"{self.trouble}{_last_words(self.output)}")
                    self.simulator.command(0.0, 0.0)
                self._readings += self.simulator.step(_TICK_S)
            self._recorder.take(self._readings)
            self._readings.clear()

    def _call(self, service: str, **fields: object) -> Any:
        """Return a service's response, None if there was none; `_silence` then says why."""
        with self._lock:
            self._silence = f"no node offers {service}"
            stage = self._stage
            if stage is None or not self._alive():
                return None
            answers: list[Any] = []
            client = stage._clients.get(service)
            if client is None or not client.service_is_ready():
                return None
            from grader.trials.flatten import fill
            from grader.trials.types import SERVICES

            future = client.call_async(fill(SERVICES[service].Request(), fields))
            stage._await(future.done)
            if not future.done():
                client.remove_pending_request(future)
                self._silence = f"{service} gave no answer"
                return None
            answers.append(future.result())
            stage.bridge.settle()
            return answers[0]

    _silence = ""

    def _click(self, x: float, y: float) -> str:
        """Send the goal that was clicked, map frame, and say what came of it."""
        from sim import Pose

        stage = self._stage
        if stage is None or not self._alive() or not stage.action or not stage.action.server_is_ready():
            return "no node offers the action navigate_to_position"
        place = self.simulator.odom_origin.inverse().compose(Pose(x, y, 0.0))
        goal = stage.navigate(place.x, place.y, 0.1)
        if goal.accepted:
            return f"goal sent: ({x:.2f}, {y:.2f}) m"
        return goal.problem or "the node rejected the goal"

    def _again(self) -> None:
        """Start the node anew after the simulator was set back: for a node time does not go back."""
        self._end()
        for heard in self._messages.values():
            heard.clear()
        self.trouble = ""
        self._begin()

    def _alive(self) -> bool:
        return self._process is not None and self._process.exit_code() is None and not self.trouble

    def _last_command(self) -> Any:
        heard = self._messages["cmd_vel"]
        return heard[-1][1] if heard else None

    def _give_up(self, why: str) -> None:
        self.trouble = why
        self._tell(why)
        self._end()

    def _tell(self, why: str) -> None:
        print(f"not yet: {why}")

    def _end(self) -> None:
        stage, self._stage = self._stage, None
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            self._output = process.output
        if stage is not None:
            stage.close()


# -- processes --------------------------------------------------------------------------------------------------------


class _NodeProcess:
    """A node of the student's on this machine, in a process group of its own, with the methods that a Stage needs."""

    def __init__(self, command: list[str], environment: Mapping[str, str]) -> None:
        self.started = time.monotonic()
        self._text = bytearray()
        self._popen = subprocess.Popen(
            [sys.executable, "-c", _GUARD, str(os.getpid()), *command],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=dict(environment),
            start_new_session=True,
        )  # fmt: skip
        self._reader = threading.Thread(target=_read, args=(self._popen, self._text), daemon=True)
        self._reader.start()
        _PROCESSES.add(self)

    @property
    def wall_seconds(self) -> float:
        return time.monotonic() - self.started

    @property
    def output(self) -> str:
        return bytes(self._text).decode("utf-8", "replace")

    def exit_code(self) -> int | None:
        return self._popen.poll()

    def interrupt(self) -> None:
        with suppress(ProcessLookupError):
            os.kill(self._popen.pid, signal.SIGINT)

    def kill(self) -> None:
        """End the whole group and wait for it."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._popen.pid, signal.SIGKILL)
        self._popen.wait(_KILL_AFTER_S)
        self._reader.join(_KILL_AFTER_S)
        _PROCESSES.discard(self)


# The node dies with the kernel, however that ends: PR_SET_PDEATHSIG, set between fork and exec by this one-liner.
_GUARD = """
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGKILL)
if os.getppid() != int(sys.argv[1]): sys.exit(1)
os.execv(sys.argv[2], sys.argv[2:])
"""
_PROCESSES: weakref.WeakSet[_NodeProcess] = weakref.WeakSet()


def _read(popen: subprocess.Popen[bytes], text: bytearray) -> None:
    assert popen.stdout is not None
    with popen.stdout as stream:
        while chunk := os.read(stream.fileno(), 65536):
            if len(text) < _OUTPUT_CAP:
                text += chunk


@atexit.register
def _kill_all() -> None:
    for process in list(_PROCESSES):
        process.kill()


# -- words ------------------------------------------------------------------------------------------------------------


def _plain(why: str, process: _NodeProcess) -> str:
    return why if process.exit_code() is None else f"{why}{_last_words(process.output)}"


def _last_words(output: str) -> str:
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    return f"; its last words: {lines[-1][:300]}" if lines else ""


def _pose() -> Any:
    from geometry_msgs.msg import Pose

    return Pose()


# -- interface types --------------------------------------------------------------------------------------------------


def types(workspace: Workspace) -> None:
    """Make the contract's interface types importable in this process, beside the modules of the student's package.

    The loader reads LD_LIBRARY_PATH only when a process starts, so the libraries are loaded by hand; those that ROS
    looks up later by name it finds through the environment variable.
    """
    if f"{build.PACKAGE}.srv._set_speed" in sys.modules:
        return
    install = build.contract(build.cache_folder()).install
    folder = str(install / "lib")
    present = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    if folder not in present:
        os.environ["LD_LIBRARY_PATH"] = os.pathsep.join([folder, *present])
    _load_libraries(sorted(Path(folder).glob("lib*.so")))
    with _importing_from(install / toolchain.SITE_IN_PREFIX, workspace.package / build.PACKAGE):
        for kind in ("msg", "srv", "action"):
            importlib.import_module(f"{build.PACKAGE}.{kind}")
        importlib.import_module("grader.trials.types")
        _load_type_support()


def _load_libraries(paths: list[Path]) -> None:
    """Load shared libraries whose dependencies are among them, in whatever order works."""
    left = paths
    while left:
        failed = []
        for path in left:
            try:
                ctypes.CDLL(str(path), ctypes.RTLD_GLOBAL)
            except OSError:
                failed.append(path)
        if len(failed) == len(left):
            raise GraderError(f"Cannot load the contract's interfaces: {failed[0].name}. Run `grader doctor`.")
        left = failed


@contextmanager
def _importing_from(site: Path, own_modules: Path) -> Iterator[None]:
    """Import the package's name from `site` alone; afterwards it means the types and `own_modules` together.

    That is what `extend_path` in the package's `__init__.py` does, were it there and right. The name has to stay known
    from then on: rosidl's C code asks for it with each message, and ends the process if it is not.
    """
    hidden = {name: sys.modules.pop(name) for name in list(sys.modules) if name.partition(".")[0] == build.PACKAGE}
    hidden.pop(build.PACKAGE, None)
    sys.path.insert(0, str(site))
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path.remove(str(site))
        sys.modules.update(hidden)
        sys.modules[build.PACKAGE].__path__.insert(0, str(own_modules))
        importlib.invalidate_caches()


def _load_type_support() -> None:
    from grader.trials import types as found

    for kind in (found.SensorFusionData, found.SetSpeed, found.GetRobotStatus, found.NavigateToPosition):
        kind.__class__.__import_type_support__()


# -- one session a node -----------------------------------------------------------------------------------------------

_RUNS: dict[str, Run] = {}


def start(workspace: Workspace, node: str, world: str | World, **options: Any) -> Run:
    """Return a new session with a node; an older one with the same node is closed first."""
    if node in _RUNS:
        _RUNS[node].close()
    _RUNS[node] = Run(workspace, node, world, **options)
    return _RUNS[node]
