"""The live view for Jupyter: the robot drives in a thread while the kernel stays free; a widget shows and steers it.

`Feed` says what a browser must know, and then only what changed. `Pacer` keeps the wished speed. `Live` owns the
thread, takes the browser's commands between two steps, and is what a notebook shows. Nothing comes from the network:
live_view.js and live_view.css lie beside this file. No ROS here; a bridge's `tick` is a `step` like any other.
"""

from __future__ import annotations

import atexit
import base64
import io
import math
import threading
import time
import traceback
import uuid
import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from sim.drive import Driver, Seen, Tourist
from sim.geometry import Point, Pose
from sim.obstacles import Box, Circle, CirclePart, Obstacle, Path, Polygon, PolygonPart, SegmentPart, moved_to
from sim.scene import Scene
from sim.sensors import OdometryReading, ScanReading
from sim.simulator import Simulator
from sim.views import COLORS, View, map_view

PROTOCOL = 1
MAX_BEAMS = 180
MAX_PATH = 4000  # points; beyond it every second one is left out
PATH_M = 0.02  # a point of the path is kept when it is so far from the last
CONTROL_S = 0.1  # how often a driver is asked, as in `sim.drive`; also what the Step button advances
BEHIND_S = 0.1  # of wall time: a longer stall of a busy machine is not caught up
# After how much silence a view counts as closed: views say every 4 s that they are there, a hidden tab once a minute,
# and where a busy cell keeps the kernel from hearing it, nobody can tell.
LOST_S, HIDDEN_LOST_S, UNHEARD_LOST_S = 15.0, 180.0, 600.0
GRACE_S = 2.0  # how long `run` waits for a front end before it goes on without
SHORT_GRACE_S = 0.2  # the same, once it has waited in vain and as long as no view has been heard of
NO_RANGE = 65535  # centimetres on the wire: nothing seen
ROOM_M = 0.01  # what is dragged keeps this distance from the hull

WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"

Message = dict[str, Any]


class Channel(Protocol):
    """Where messages go: the widget, or a list in a test."""

    def send(self, content: Message, buffers: list[bytes]) -> None:
        """Send one message to every open view."""


@dataclass
class Pacer:
    """Says when the next step is due, in wall seconds of whatever clock it is given.

    Attributes:
        rate: simulated seconds per wall second; inf as fast as it goes.
    """

    rate: float = 1.0
    _due: float = -math.inf

    def wait(self, now: float) -> float:
        """Return the seconds until the next step is due, 0 if it is."""
        return 0.0 if math.isinf(self.rate) else max(0.0, self._due - now)

    def stepped(self, dt: float, now: float) -> None:
        """Note a step of `dt` simulated seconds."""
        begin = self._due if self._due > now - BEHIND_S else now
        self._due = begin + dt / self.rate


class Feed:
    """What the browser must know about a simulator: everything once, then what changed.

    Places are metres in the map frame, rounded to millimetres; the scan travels beside the message, as centimetres in
    16 bits, `NO_RANGE` for a beam without a valid reading.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._stride = max(1, math.ceil(simulator.profile.lidar.beams.count / MAX_BEAMS))
        self._told: dict[str, tuple[Obstacle, Point]] = {}
        self._contacts_told = self._path_told = 0
        self._scene_due = True
        self.path: list[Point] = []
        """Where the robot has been since the last reset, map frame, m."""
        self._time = -math.inf
        self.follow()

    def follow(self) -> None:
        """Take down the path; to be called after every step. A simulator that was reset begins a new one."""
        sim = self._simulator
        if sim.time < self._time:
            self.path = []
            self.begin()
        self._time = sim.time
        place = (sim.pose.x, sim.pose.y)
        if not self.path or math.dist(self.path[-1], place) >= PATH_M:
            self.path.append(place)
        if len(self.path) > MAX_PATH:
            self.path = self.path[::2]
            self._path_told = 0

    def begin(self) -> None:
        """Say everything again with the next message: a view has been opened, or time has gone back."""
        self._scene_due = True
        self._told = {}
        self._contacts_told = self._path_told = 0

    def message(self) -> tuple[Message, bytes]:
        """Return what changed since the last call, and the scan as it is now."""
        self.follow()
        sim = self._simulator
        pose, twist, command = sim.pose, sim.twist, sim.commanded
        sensor = pose.compose(sim.profile.lidar.pose)
        message: Message = {
            "t": round(sim.time, 3),
            "pose": [*_millimetres(pose.x, pose.y), round(pose.yaw, 4)],
            "sensor": [*_millimetres(sensor.x, sensor.y), round(sensor.yaw, 4)],
            "twist": [round(twist.v, 3), round(twist.omega, 3)],
            "command": [round(command.v, 3), round(command.omega, 3)],
            "clearance": _finite(sim.clearance()),
            "touching": sim.in_contact,
        }
        if self._scene_due:
            self._scene_due = False
            message["scene"] = self._scene()
        self._add_obstacles(message)
        if self._path_told < len(self.path):
            # The index from which on the points replace those that the view has, then x, y, x, y ...
            points = [value for p in self.path[self._path_told :] for value in _millimetres(*p)]
            message["path"] = [self._path_told, *points]
            self._path_told = len(self.path)
        if contacts := sim.contacts[self._contacts_told :]:
            message["contacts"] = [[*_millimetres(*c.point), round(c.time, 2), c.obstacle] for c in contacts]
            self._contacts_told += len(contacts)
        return message, _centimetres(sim.scan().ranges[:: self._stride])

    def _scene(self) -> Message:
        sim, beams = self._simulator, self._simulator.profile.lidar.beams
        return {
            "protocol": PROTOCOL,
            "world": sim.world.name,
            "title": sim.world.title,
            "radius": sim.profile.radius,
            "angle_min": beams.angle_min,
            "increment": beams.increment * self._stride,
            "full_circle": beams.is_full_circle,
            "bounds": _bounds(sim),
            "goals": [_millimetres(g.x, g.y) for g in sim.world.goals],
            "colors": COLORS,
            "step_s": CONTROL_S,
        }

    def _add_obstacles(self, message: Message) -> None:
        """Put in the obstacles that are new, those that moved, and the names of those that have gone."""
        there = {obstacle.name: (obstacle, place) for obstacle, place in self._simulator.obstacles}
        new, moved = [], {}
        for name, (obstacle, place) in there.items():
            told = self._told.get(name)
            if told is None or told[0] is not obstacle:
                new.append(_shape(obstacle, place))
            elif told[1] != place:
                moved[name] = _millimetres(*place)
        gone = [name for name in self._told if name not in there]
        self._told = there
        for key, value in (("new", new), ("moved", moved), ("gone", gone)):
            if value:
                message[key] = value


class Guide(Tourist):
    """The driver of a view that is given none: visits the world's goals, and whatever place is clicked."""

    def go_to(self, x: float, y: float) -> None:
        """Drop what was planned and go to a place (m, map frame)."""
        self._goals, self._way, self._endless = [(x, y)], [], False


class Drive:
    """A `step` that asks a driver every `CONTROL_S` of simulated time, as `sim.drive` does."""

    def __init__(self, simulator: Simulator, driver: Driver) -> None:
        self.driver = driver
        self._simulator = simulator
        self.restart()

    def restart(self) -> None:
        """Begin anew after a reset."""
        self._due = self._simulator.time
        self._seen = Seen(self._due, self._simulator.scan(), self._simulator.odometry())

    def __call__(self, dt: float) -> None:
        """Advance by `dt` simulated seconds."""
        if self._simulator.time >= self._due - 1e-9:
            command = self.driver(self._seen)
            self._simulator.command(command.v, command.omega)
            self._due += CONTROL_S
        scan, odometry = self._seen.scan, self._seen.odometry
        for reading in self._simulator.step(dt):
            if isinstance(reading, ScanReading):
                scan = reading
            elif isinstance(reading, OdometryReading):
                odometry = reading
        self._seen = Seen(self._simulator.time, scan, odometry)


class Live:
    """A simulator that runs beside the notebook and can be watched and steered while it does.

        Live(Simulator(load_world("office")))                    # the built-in driver; clicks become its goals
        Live(simulator, driver=my_driver)                        # a function from Seen to Twist
        Live(simulator, step=bridge.tick, on_goal=send_goal)     # a ROS node, in lockstep

    Shown as a cell's result it starts; it runs while a front end shows it, and in `run`. Without a front end it shows
    a picture of where the robot is. `stop` ends it and leaves such a picture in the saved notebook.

    Args:
        simulator: the robot. The thread steps it; to change it from a cell use `hold`.
        driver: commands the robot every 0.1 s; without it and without `step` the robot visits the world's goals.
        step: advances the simulator by the seconds it is given, for example a bridge's `tick`.
        on_goal: called with x, y (m, map frame) between two steps when the map is clicked. What it returns, if it
            is text, is shown.
        on_reset: called after the simulator was reset, for drivers and nodes that remember things.
        rate: simulated seconds per wall second to begin with; `math.inf` as fast as it goes.
        period: simulated seconds per step; without it 0.05 with `step`, a bridge's tick, else 0.025.
        fps: pictures sent per wall second at most.

    Raises:
        ValueError: driver and step are both given, or a number makes no sense.
    """

    _shown: ClassVar[weakref.WeakValueDictionary[str, Live]] = weakref.WeakValueDictionary()
    _grace_s: ClassVar[float] = GRACE_S

    def __init__(
        self,
        simulator: Simulator,
        driver: Driver | None = None,
        *,
        step: Callable[[float], object] | None = None,
        on_goal: Callable[[float, float], object] | None = None,
        on_reset: Callable[[], object] | None = None,
        rate: float = 1.0,
        period: float | None = None,
        fps: float = 30.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if driver is not None and step is not None:
            raise ValueError("give a driver or a step, not both: a step such as bridge.tick brings its own commands")
        if not (rate > 0 and fps > 0):
            raise ValueError(f"rate = {rate} and fps = {fps} must be above 0")
        self.simulator = simulator
        self.error: BaseException | None = None
        """What a step, a driver or a callback raised; the robot stands since then."""
        self._period = period if period is not None else (0.05 if step else 0.025)
        self._on_goal, self._on_reset = on_goal, on_reset
        self._drive: Drive | None = None
        if step is None:
            self._drive = Drive(simulator, driver or self._new_guide())
        self._step: Callable[[float], object] = step or self._drive  # type: ignore[assignment]  # one of them is there
        self._has_guide = driver is None and step is None
        self._clock = clock
        self._feed = Feed(simulator)
        self._pacer = Pacer(rate)
        self._fps = fps

        self._lock = threading.RLock()  # the simulator
        self._wake = threading.Condition()  # guards the five below
        self._inbox: list[Message] = []
        self._guests = 0
        self._stopping = False
        self._thread: threading.Thread | None = None
        self._seen_view = threading.Event()

        self._running = True
        self._unwatched = False  # runs though nobody watches
        self._left: float | None = None  # simulated seconds until it pauses by itself
        self._until: Callable[[], object] | None = None
        self._views: dict[str, float] = {}  # until when each counts as open
        self._frame_due = -math.inf
        self._news = True
        self._goal: list[float] | None = None
        self._note = ""
        self._notes = self._frames = 0
        self._elapsed = self._speed = 0.0
        self._measured = (0.0, 0.0)

        self._channel: Channel | None = None
        self._widget: Any = None
        self._display_id = ""

    # ------------------------------------------------------------- what a notebook calls

    @property
    def is_running(self) -> bool:
        """Whether simulated time goes on now."""
        return self._thread is not None and self._may_step()

    @property
    def is_stopped(self) -> bool:
        """Whether `stop` has ended it."""
        return self._stopping

    def start(self) -> Self:
        """Run, whether or not anybody watches."""
        self._start_thread()
        self._do(self._keep_running)
        return self

    def pause(self) -> None:
        """Let the robot stand until `start`, or until Run is pressed. Return when it stands."""
        self._do(self._pause)

    def reset(self) -> None:
        """Go back to the start. Return when it is done."""
        self._do(self._reset)

    def set_rate(self, rate: float) -> None:
        """Set the simulated seconds per wall second, `math.inf` for as fast as it goes.

        Raises:
            ValueError: it is not above 0.
        """
        if not rate > 0:
            raise ValueError(f"rate = {rate} must be above 0")
        self._do(lambda: self._set_rate(rate))

    def run(self, seconds: float, until: Callable[[], object] | None = None) -> None:
        """Run for so many simulated seconds, or until `until()` is true, then pause and return.

        With a front end at the chosen speed, without one as fast as it goes: a notebook that is run from top to
        bottom gets the same result, and soon.

        Raises:
            ValueError: seconds is not a finite number above 0.
            RuntimeError: it has been stopped.
            Exception: what the driver, the step or a callback raised.
        """
        if not 0 < seconds < math.inf:
            raise ValueError(f"seconds = {seconds} must be a finite number above 0")
        if self._widget is not None and not self._seen_view.wait(Live._grace_s):
            Live._grace_s = SHORT_GRACE_S
        try:  # an interrupt may come as soon as the thread runs
            self._do(lambda: self._run_for(seconds, until))
            self._start_thread()
            with self._wake:
                while self._left is not None and self._thread is not None and self._thread.is_alive():
                    self._wake.wait(0.5)
        except KeyboardInterrupt:
            self.pause()
            raise
        if self.error is not None:
            raise self.error
        if not self._seen_view.is_set():
            self._show_picture()

    @contextmanager
    def hold(self) -> Iterator[Simulator]:
        """Give the simulator between two steps, to be changed from a cell: `with live.hold() as simulator: ...`."""
        with self._wake:
            self._guests += 1
        try:
            with self._lock:
                yield self.simulator
                self._news = True
        finally:
            with self._wake:
                self._guests -= 1
                self._wake.notify_all()

    def stop(self) -> None:
        """End the thread; leave a picture of the last state where the view was. Can be called again."""
        with self._wake:
            if self._stopping:
                return
            self._stopping = True
            self._wake.notify_all()
        atexit.unregister(self.stop)
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        self._running, self._left = False, None
        if self._display_id:
            self._send(self._clock())
            self._show_picture()
        widget, self._widget, self._channel = self._widget, None, None
        if widget is not None:
            widget.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def picture(self) -> View:
        """Return the map with the robot where it is now and its path."""
        with self.hold():
            figure = map_view(self.simulator)
            axes = figure.axes[0]
            path = [*self._feed.path, (self.simulator.pose.x, self.simulator.pose.y)]
            axes.plot(*zip(*path, strict=True), color=COLORS["path"], linewidth=1.8, zorder=3, label="path")
            if contacts := self.simulator.contacts:
                places = np.array([c.point for c in contacts])
                axes.plot(*places.T, "X", color=COLORS["contact"], markersize=11, zorder=7, label="contact")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, fontsize=8, frameon=False)
        return figure

    # ------------------------------------------------------------- how a notebook shows it

    def __repr__(self) -> str:
        # The same at any time: stored outputs are compared (nbval).
        return f"Live view of {self.simulator.world.name!r}"

    def _repr_mimebundle_(self, **_: object) -> tuple[Message, Message]:
        """Return the widget where there is one, a picture and a text, for the front end to choose from."""
        png = io.BytesIO()
        figure = self.picture()
        figure.savefig(png, format="png", dpi=96)
        bundle: Message = {"text/plain": repr(self), "image/png": base64.b64encode(png.getvalue()).decode()}
        if self._widget is not None:
            bundle[WIDGET_VIEW] = {"version_major": 2, "version_minor": 0, "model_id": self._widget.model_id}
        return bundle, {"image/png": {"alt": figure.get_suptitle()}}

    def _ipython_display_(self) -> None:
        from IPython.display import display

        if not self._stopping:
            self._replace_older()
            self._open_widget()
            self._start_thread()
        self._display_id = self._display_id or uuid.uuid4().hex
        bundle, metadata = self._repr_mimebundle_()
        display(bundle, metadata=metadata, raw=True, display_id=self._display_id)  # type: ignore[no-untyped-call]

    def _show_picture(self) -> None:
        """Put a picture of the present state where the view is, so that the saved notebook shows it anywhere."""
        if self._display_id:
            from IPython.display import update_display

            bundle, metadata = self._repr_mimebundle_()
            bundle.pop(WIDGET_VIEW, None)
            update_display(bundle, metadata=metadata, raw=True, display_id=self._display_id)  # type: ignore[no-untyped-call]

    def _open_widget(self) -> None:
        if self._widget is None:
            self._widget = _new_widget()
        if self._widget is not None and self._channel is None:
            self._channel = self._widget
            self._widget.on_msg(lambda _widget, content, _buffers: self.receive(content))
            self._widget.observe(self._notice_closing, "comm")
            comm = self._widget.comm
            comm.on_close(lambda _message: self.stop())
            # JupyterLab sends commands to a thread of their own (a subshell). ipykernel 7 would hand them to whichever
            # thread the comm spoke from last, the main one, which a cell may keep busy with a student's node.
            comm._reply_subshell_for = lambda _data, wanted: wanted

    def _notice_closing(self, change: Mapping[str, object]) -> None:
        if change["new"] is None:
            self.stop()

    def _replace_older(self) -> None:
        """Stop the view that this cell showed when it was run before."""
        cell = _cell_id()
        if cell:
            older = self._shown.get(cell)
            if older is not None and older is not self:
                older._display_id = ""  # its output has been cleared
                older.stop()
            self._shown[cell] = self

    # ------------------------------------------------------------- commands

    def receive(self, content: object) -> None:
        """Take a message from the browser; it is obeyed between two steps. What is no command is left alone."""
        command = _command(content)
        if command is None:
            return
        if "view" in command:
            busy_cells_deafen = threading.current_thread() is threading.main_thread()
            command["patience"] = UNHEARD_LOST_S if busy_cells_deafen else LOST_S
            if command["hidden"]:
                command["patience"] = max(command["patience"], HIDDEN_LOST_S)
            self._seen_view.set()
            Live._grace_s = GRACE_S
        with self._wake:
            self._inbox.append(command)
            self._wake.notify_all()

    def _take(self) -> list[Message]:
        """Return the commands that came; of several moves of one obstacle only the last."""
        with self._wake:
            commands, self._inbox = self._inbox, []
        last = {c["name"]: i for i, c in enumerate(commands) if c["kind"] == "move"}
        return [c for i, c in enumerate(commands) if c["kind"] != "move" or last[c["name"]] == i]

    def _obey(self, command: Message, now: float) -> None:
        match command:
            case {"kind": "hello" | "alive" as kind, "view": view, "patience": patience}:
                if kind == "hello" or view not in self._views:
                    self._feed.begin()
                    self._news = True
                self._views[view] = now + patience
            case {"kind": "bye", "view": view}:
                self._views.pop(view, None)
            case {"kind": "run"}:
                self._run_on()
            case {"kind": "pause"}:
                self._pause()
            case {"kind": "step"}:
                self._single_step()
            case {"kind": "reset"}:
                self._reset()
            case {"kind": "rate", "value": value}:
                self._set_rate(value)
            case {"kind": "goal", "x": x, "y": y}:
                self._go_to(x, y)
            case {"kind": "move", "name": name, "x": x, "y": y}:
                self._move(name, x, y)

    def _run_on(self) -> None:
        self.error = None
        self._running = self._news = True

    def _keep_running(self) -> None:
        self._unwatched = True
        self._run_on()

    def _pause(self) -> None:
        self._running, self._news = False, True

    def _run_for(self, seconds: float, until: Callable[[], object] | None) -> None:
        self._left, self._until = seconds, until
        self._run_on()

    def _set_rate(self, rate: float) -> None:
        self._pacer = Pacer(rate)
        self._news = True

    def _single_step(self) -> None:
        self._pause()
        for _ in range(max(1, round(CONTROL_S / self._period))):
            self._advance()

    def _reset(self) -> None:
        self.simulator.reset()
        self.error = None
        self._goal = None
        if self._drive is not None:
            if self._has_guide:
                self._drive.driver = self._new_guide()
            self._drive.restart()
        self._call(self._on_reset)
        self._say("back at the start")

    def _new_guide(self) -> Guide:
        return Guide(self.simulator)

    def _go_to(self, x: float, y: float) -> None:
        self._goal = [x, y]
        if self._on_goal is not None:
            answer = self._call(self._on_goal, x, y)
            self._say(answer if isinstance(answer, str) else f"goal sent: ({x:.2f}, {y:.2f}) m")
        elif self._drive is not None and isinstance(self._drive.driver, Guide):
            self._drive.driver.go_to(x, y)
            self._say(f"driving to ({x:.2f}, {y:.2f}) m")
        else:
            self._goal = None
            self._say("a click does nothing here: give Live an on_goal function")

    def _move(self, name: str, x: float, y: float) -> None:
        """Put an obstacle elsewhere, unless the robot is there. A moving one begins its way anew from that place."""
        obstacle = next((o for o, _ in self.simulator.obstacles if o.name == name and _can_be_dragged(o)), None)
        if obstacle is None:
            return
        robot = self.simulator.pose
        nearest = Scene([moved_to(obstacle, (x, y))]).nearest(robot.x, robot.y)
        if nearest is not None and nearest.distance < self.simulator.profile.radius + ROOM_M:
            self._say(f"{name} cannot stand where the robot is")
            return
        self.simulator.move_obstacle(name, x, y)
        self._news = True

    def _say(self, note: str) -> None:
        self._note, self._news = note, True
        self._notes += 1

    # ------------------------------------------------------------- the thread

    def turn(self, now: float) -> float | None:
        """Obey what came, make the step that is due, send what is due; `now` is wall time in s.

        Return the seconds until there is something to do again, None if only a command can bring that about.
        """
        with self._lock:
            for command in self._take():
                self._obey(command, now)
            self._views = {view: until for view, until in self._views.items() if now <= until}
            wait: float | None = None
            if self._may_step():
                wait = self._wait(now)
                if wait <= 0.0:
                    self._advance()
                    self._pacer.stepped(self._period, now)
                    wait = self._wait(now) if self._may_step() else None
            self._measure(now)
            if self._news or (wait is not None and now >= self._frame_due):
                self._send(now)
        return wait

    def _may_step(self) -> bool:
        wanted = self._unwatched or bool(self._views) or self._left is not None
        return self._running and wanted and self.error is None and not self._stopping

    def _wait(self, now: float) -> float:
        # In `run` without a front end nobody needs the wished speed.
        return 0.0 if self._left is not None and not self._views else self._pacer.wait(now)

    def _advance(self) -> None:
        self._call(self._step, self._period)
        self._feed.follow()
        self._elapsed += self._period
        if self._left is not None:
            self._left -= self._period
            if self._left < 1e-9 or (self._until is not None and self._call(self._until)):
                self._end_run()

    def _end_run(self) -> None:
        """Pause, and let `run` return."""
        self._pause()
        # A run without a front end goes as fast as it can; nobody shall wait for the time that it was ahead.
        self._pacer = Pacer(self._pacer.rate)
        with self._wake:
            self._left = self._until = None
            self._wake.notify_all()

    def _call(self, function: Callable[..., object] | None, *arguments: object) -> object:
        """Call what others gave; what it raises stops the robot and is shown, and `run` raises it again."""
        if function is None:
            return None
        try:
            return function(*arguments)
        except Exception as error:
            self.error = error
            last = traceback.extract_tb(error.__traceback__)[-1]
            self._say(f"{type(error).__name__}: {error} (line {last.lineno} of {last.name})")
            self._end_run()
            return None

    def _measure(self, now: float) -> None:
        """Note how fast simulated time has gone during the last half second."""
        since, elapsed = self._measured
        if now - since >= 0.5:
            self._speed = (self._elapsed - elapsed) / (now - since)
            self._measured = (now, self._elapsed)

    def _send(self, now: float) -> None:
        # From when it was due, not from now: else steps and frames would beat.
        self._frame_due = max(self._frame_due, now - 1 / self._fps) + 1 / self._fps
        self._news = False
        if self._channel is None or not self._views:
            return
        message, scan = self._feed.message()
        self._frames += 1
        message |= {"n": self._frames, "goal": self._goal, "note": [self._notes, self._note], **self._status()}
        self._channel.send(message, [scan])

    def _status(self) -> Message:
        if self._stopping:
            status = "stopped"
        elif self.error is not None:
            status = "failed"
        else:
            status = "running" if self._running else "paused"
        rate = None if math.isinf(self._pacer.rate) else self._pacer.rate
        return {"status": status, "rate": rate, "speed": round(self._speed, 2)}

    def _start_thread(self) -> None:
        if self._stopping:
            raise RuntimeError("this live view has been stopped; make a new one")
        if self._thread is None:
            self._thread = threading.Thread(target=self._loop, name="live view", daemon=True)
            atexit.register(self.stop)
            self._thread.start()

    def _loop(self) -> None:
        wait: float | None = 0.0
        while True:
            with self._wake:
                if not self._inbox and not self._stopping and not self._guests and wait != 0.0:
                    self._wake.wait(wait)
                while self._guests and not self._stopping:
                    self._wake.wait()
                if self._stopping:
                    return
            wait = self.turn(self._clock())

    def _do(self, deed: Callable[[], None]) -> None:
        with self.hold():
            deed()


# ------------------------------------------------------------------------------------------------ pieces


def _command(content: object) -> Message | None:
    """Return the command in a browser's message, None if there is none that makes sense."""
    if not isinstance(content, Mapping):
        return None
    kind = content.get("kind")
    if kind in ("run", "pause", "step", "reset"):
        return {"kind": kind}
    if kind in ("hello", "bye", "alive") and isinstance(content.get("view"), str):
        return {"kind": kind, "view": content["view"], "hidden": content.get("hidden") is True}
    if kind == "rate":
        value = content.get("value")
        rate = math.inf if value is None else _number(value)
        return {"kind": kind, "value": rate} if rate is not None and rate > 0 else None
    if kind in ("goal", "move"):
        x, y = _number(content.get("x")), _number(content.get("y"))
        if x is None or y is None:
            return None
        if kind == "goal":
            return {"kind": kind, "x": x, "y": y}
        if isinstance(content.get("name"), str):
            return {"kind": kind, "name": content["name"], "x": x, "y": y}
    return None


def _number(value: object) -> float | None:
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e4
    return float(value) if fits else None  # type: ignore[arg-type]  # just asked


def _can_be_dragged(obstacle: Obstacle) -> bool:
    """Walls and maps stay: they are the building."""
    return isinstance(obstacle, Box | Circle | Polygon)


def _shape(obstacle: Obstacle, place: Point) -> Message:
    """Return an obstacle as plain data: its parts relative to its centre, axes along the map's."""
    turned = Pose(0.0, 0.0, obstacle.pose.yaw).point_to_parent
    parts: list[list[float]] = []
    for part in obstacle.parts():
        match part:
            case SegmentPart():
                parts.append([*_millimetres(*turned(part.start)), *_millimetres(*turned(part.end))])
            case CirclePart():
                parts.append([*_millimetres(*turned(part.center)), round(part.radius, 3)])
            case PolygonPart():
                parts.append([value for corner in part.corners for value in _millimetres(*turned(corner))])
    return {
        "name": obstacle.name,
        "at": _millimetres(*place),
        "parts": parts,  # 3 numbers a circle, 4 a line, 6 and more a polygon
        "moves": obstacle.motion is not None,
        "drag": _can_be_dragged(obstacle),
    }


def _bounds(simulator: Simulator, reach: float = 8.0, margin: float = 0.4) -> list[float]:
    """Return x, y of the lower left and of the upper right corner of what to show, in m; what is far off is cut."""
    world = simulator.world
    places = [(p.x, p.y) for p in (world.start, simulator.pose, *world.goals)]
    low, high = np.min(places, axis=0) - reach, np.max(places, axis=0) + reach
    places += [corner for obstacle in world.obstacles for corner in _corners(obstacle)]
    if not world.obstacles:
        margin = 2.0
    x0, y0 = np.maximum(np.min(places, axis=0), low) - margin
    x1, y1 = np.minimum(np.max(places, axis=0), high) + margin
    return [round(float(value), 2) for value in (x0, y0, x1, y1)]


def _corners(obstacle: Obstacle) -> list[Point]:
    """Return points of an obstacle's outline in the map frame, and of the way that it goes."""
    found = list(obstacle.motion.waypoints) if isinstance(obstacle.motion, Path) else []
    for part in obstacle.parts():
        match part:
            case SegmentPart():
                corners: tuple[Point, ...] = (part.start, part.end)
            case CirclePart():
                (x, y), r = part.center, part.radius
                corners = ((x - r, y), (x + r, y), (x, y - r), (x, y + r))
            case PolygonPart():
                corners = part.corners
        found += [obstacle.pose.point_to_parent(corner) for corner in corners]
    return found


def _millimetres(x: float, y: float) -> list[float]:
    return [round(x, 3), round(y, 3)]


def _finite(value: float) -> float | None:
    return round(value, 3) if math.isfinite(value) else None


def _centimetres(ranges: Any) -> bytes:
    valid = np.isfinite(ranges)
    centimetres = np.clip(np.round(np.where(valid, ranges, 0.0) * 100), 0, NO_RANGE - 1)
    return np.where(valid, centimetres, NO_RANGE).astype("<u2").tobytes()


def _new_widget() -> Any:
    """Return the widget; None where there is no kernel to talk to, or no anywidget."""
    if not _cell_message():
        return None
    try:
        import anywidget
    except ImportError:
        return None
    here = files("sim")

    class LiveView(anywidget.AnyWidget):
        _esm = here.joinpath("live_view.js").read_text(encoding="utf-8")
        _css = here.joinpath("live_view.css").read_text(encoding="utf-8")

    return LiveView()


def _cell_message() -> Mapping[str, Any]:
    """Return the front end's request that is being executed, nothing outside a kernel."""
    from IPython.core.getipython import get_ipython

    shell = get_ipython()
    if shell is None or not hasattr(shell, "get_parent"):
        return {}
    message = shell.get_parent()
    return message if isinstance(message, Mapping) else {}


def _cell_id() -> str:
    return str(_cell_message().get("metadata", {}).get("cellId", ""))
