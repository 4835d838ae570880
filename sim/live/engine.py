"""The thread that runs a simulator: executes commands between two steps, paces the steps, and ends a run.

It knows neither kernel nor widget; `sim.live.view` shows it in a notebook.
"""

from __future__ import annotations

import atexit
import math
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Self

from sim.drive import CONTROL_S, ControlLoop, Driver
from sim.live.audience import Audience, patience_s
from sim.live.protocol import Feed, Message, can_be_dragged, parse_command
from sim.scene import Scene
from sim.simulator import Simulator
from sim.tourist import Tourist
from sim.transform import moved_to

DRAG_CLEARANCE_M = 0.01  # between a dragged obstacle and the hull
BEHIND_S = 0.1  # of wall time: a longer stall of a busy machine is not caught up


@dataclass
class Pacer:
    """When the next step is due, in wall seconds; the caller provides the clock.

    Attributes:
        rate: simulated seconds per wall second; inf for as fast as possible.
    """

    rate: float = 1.0
    _due: float = -math.inf

    def wait(self, now: float) -> float:
        """Return the seconds until the next step is due, 0 if it is due now."""
        return 0.0 if math.isinf(self.rate) else max(0.0, self._due - now)

    def stepped(self, dt: float, now: float) -> None:
        """Record a step of `dt` simulated seconds."""
        begin = self._due if self._due > now - BEHIND_S else now
        self._due = begin + dt / self.rate


class Engine:
    """A simulator that runs in a thread of its own; see `Live` for the arguments.

    Every request is carried out between two steps, in whichever thread: `_lock` guards the simulator and everything
    that belongs to it, `_wake` the state that wakes the thread.
    """

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
        """The exception of a step, a driver or a callback; the robot has stood still since."""
        self._period = period if period is not None else (0.05 if step else 0.025)
        self._on_goal, self._on_reset = on_goal, on_reset
        self._has_default_driver = driver is None and step is None
        self._loop: ControlLoop | None = None
        if step is None:
            step = self._loop = ControlLoop(simulator, driver or Tourist(simulator))
        self._step = step
        self._clock = clock
        self._feed = Feed(simulator)
        self._audience = Audience(self._feed, fps)
        self._pacer = Pacer(rate)

        self._lock = threading.RLock()  # the simulator
        self._wake = threading.Condition()  # guards the five below
        self._inbox: list[Message] = []
        self._holders = 0
        self._changed = False  # since the thread last looked: how long it meant to wait says nothing any more
        self._stopping = False
        self._thread: threading.Thread | None = None
        self._seen_view = threading.Event()

        self._running = True
        self._unwatched = False  # run even without a view
        self._left: float | None = None  # simulated seconds until `run` ends
        self._until: Callable[[], object] | None = None
        self._goal: list[float] | None = None
        self._progress: str | None = None  # last said of the built-in driver's way to `_goal`, None if it has none
        self._elapsed = self._speed = 0.0
        self._measured = (0.0, 0.0)

    # ------------------------------------------------------------- what the owner calls

    @property
    def is_running(self) -> bool:
        """Whether simulated time is advancing."""
        return self._thread is not None and self._may_step()

    @property
    def is_stopped(self) -> bool:
        """Whether `stop` has been called."""
        return self._stopping

    def start(self) -> Self:
        """Run, whether or not a view is open."""
        self._start_thread()
        self._apply(self._keep_running)
        return self

    def pause(self) -> None:
        """Stop simulated time until `start`, or until Run is pressed. Return when it has stopped."""
        self._apply(self._pause)

    def reset(self) -> None:
        """Go back to the start. Return when it is done."""
        self._apply(self._reset)

    def set_rate(self, rate: float) -> None:
        """Set the simulated seconds per wall second; `math.inf` for as fast as possible.

        Raises:
            ValueError: it is not above 0.
        """
        if not rate > 0:
            raise ValueError(f"rate = {rate} must be above 0")
        self._apply(lambda: self._set_rate(rate))

    def run(self, seconds: float, until: Callable[[], object] | None = None) -> None:
        """Run for that many simulated seconds, or until `until()` is true, then pause and return.

        With a front end this runs at the chosen speed, without one as fast as possible, so that a notebook executed
        from top to bottom gets the same result quickly.

        Raises:
            ValueError: seconds is not a finite number above 0.
            RuntimeError: the view has been stopped.
            Exception: whatever the driver, the step or a callback raised.
        """
        if not 0 < seconds < math.inf:
            raise ValueError(f"seconds = {seconds} must be a finite number above 0")
        self._before_run()
        try:  # an interrupt may come as soon as the thread runs
            self._apply(lambda: self._run_for(seconds, until))
            self._start_thread()
            with self._wake:
                while self._left is not None and self._thread is not None and self._thread.is_alive():
                    self._wake.wait(0.5)
        except KeyboardInterrupt:
            self.pause()
            raise
        if self.error is not None:
            raise self.error
        self._after_run()

    @contextmanager
    def hold(self) -> Iterator[Simulator]:
        """Yield the simulator between two steps, so that a cell can change it: `with live.hold() as simulator: ...`."""
        with self._wake:
            self._holders += 1
        try:
            with self._lock:
                yield self.simulator
                self._audience.has_news = True
        finally:
            with self._wake:
                self._holders -= 1
                self._changed = True
                self._wake.notify_all()

    def stop(self) -> None:
        """End the thread and leave a picture of the last state in place of the view. Further calls do nothing."""
        with self._wake:
            if self._stopping:
                return
            self._stopping = True
            self._wake.notify_all()
        atexit.unregister(self.stop)
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        self._running, self._left = False, None
        self._after_stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _before_run(self) -> None:
        """Prepare a run; for subclasses."""

    def _after_run(self) -> None:
        """Follow up a run that succeeded; for subclasses."""

    def _after_stop(self) -> None:
        """Clean up at the end; for subclasses."""

    # ------------------------------------------------------------- commands

    def receive(self, content: object) -> None:
        """Queue a message from the browser, to be executed between two steps. Invalid messages are ignored."""
        command = parse_command(content)
        if command is None:
            return
        if "view" in command:
            command["patience"] = patience_s(command["hidden"])
            self._seen_view.set()
        with self._wake:
            self._inbox.append(command)
            self._wake.notify_all()

    def _take_commands(self) -> list[Message]:
        """Return the queued commands; of several moves of one obstacle only the last."""
        with self._wake:
            commands, self._inbox = self._inbox, []
        last = {c["name"]: i for i, c in enumerate(commands) if c["kind"] == "move"}
        return [c for i, c in enumerate(commands) if c["kind"] != "move" or last[c["name"]] == i]

    def _execute(self, command: Message, now: float) -> None:
        match command:
            case {"kind": "hello" | "alive" as kind, "view": view, "patience": patience}:
                self._audience.keep(view, now + patience, begins=kind == "hello")
            case {"kind": "bye", "view": view}:
                self._audience.leave(view)
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
        self._running = self._audience.has_news = True

    def _keep_running(self) -> None:
        self._unwatched = True
        self._run_on()

    def _pause(self) -> None:
        self._running, self._audience.has_news = False, True

    def _run_for(self, seconds: float, until: Callable[[], object] | None) -> None:
        self._left, self._until = seconds, until
        self._run_on()

    def _set_rate(self, rate: float) -> None:
        self._pacer = Pacer(rate)
        self._audience.has_news = True

    def _single_step(self) -> None:
        self._pause()
        for _ in range(max(1, round(CONTROL_S / self._period))):
            self._advance()

    def _reset(self) -> None:
        self.simulator.reset()
        self.error = None
        self._goal = self._progress = None
        if self._loop is not None:
            if self._has_default_driver:
                self._loop.driver = Tourist(self.simulator)
            self._loop.restart()
        self._call(self._on_reset)
        self._audience.say("reset to the start")

    def _go_to(self, x: float, y: float) -> None:
        self._goal = [x, y]
        if self._on_goal is not None:
            answer = self._call(self._on_goal, x, y)
            self._audience.say(answer if isinstance(answer, str) else f"goal sent: ({x:.2f}, {y:.2f}) m")
        elif self._loop is not None and isinstance(self._loop.driver, Tourist):
            self._loop.driver.go_to(x, y)
            self._progress = ""
            self._report_progress()
        else:
            self._goal = None
            self._audience.say("clicking the map does nothing here: give Live an on_goal function")

    def _move(self, name: str, x: float, y: float) -> None:
        """Move an obstacle, unless the robot is in that place."""
        obstacle = next((o for o, _ in self.simulator.obstacles if o.name == name and can_be_dragged(o)), None)
        if obstacle is None:
            return
        robot = self.simulator.pose
        nearest = Scene([moved_to(obstacle, (x, y))]).nearest(robot.x, robot.y)
        if nearest is not None and nearest.distance < self.simulator.profile.radius + DRAG_CLEARANCE_M:
            self._audience.say(f"{name} cannot be put where the robot is")
            return
        self.simulator.move_obstacle(name, x, y)
        self._audience.has_news = True

    # ------------------------------------------------------------- the thread

    def cycle(self, now: float) -> float | None:
        """Execute the queued commands, make a step if one is due, send a frame if one is due; `now` is wall time in s.

        Return the seconds until there is something to do again, None if only a command can cause that.
        """
        with self._lock:
            for command in self._take_commands():
                self._execute(command, now)
            self._audience.drop_silent(now)
            wait: float | None = None
            if self._may_step():
                wait = self._wait(now)
                if wait <= 0.0:
                    self._advance()
                    self._pacer.stepped(self._period, now)
                    wait = self._wait(now) if self._may_step() else None
            self._measure(now)
            if self._audience.has_news or (wait is not None and self._audience.is_due(now)):
                self._audience.send(now, self._state())
        return wait

    def _may_step(self) -> bool:
        wanted = self._unwatched or self._audience.is_present or self._left is not None
        return self._running and wanted and self.error is None and not self._stopping

    def _wait(self, now: float) -> float:
        # `run` without a front end ignores the rate: there is no view to keep it for.
        return 0.0 if self._left is not None and not self._audience.is_present else self._pacer.wait(now)

    def _advance(self) -> None:
        self._call(self._step, self._period)
        self._feed.follow()
        self._elapsed += self._period
        self._report_progress()
        if self._left is not None:
            self._left -= self._period
            if self._left < 1e-9 or (self._until is not None and self._call(self._until)):
                self._end_run()

    def _report_progress(self) -> None:
        """Say how far the built-in driver has come with a clicked goal, when that changes."""
        driver = self._loop.driver if self._loop is not None else None
        if self._progress is None or self._goal is None or not isinstance(driver, Tourist):
            return
        going = "waiting before an obstacle, on the way to" if driver.is_blocked else "driving to"
        words = "arrived at" if driver.has_arrived() else going
        if words != self._progress:
            self._progress = words
            x, y = self._goal
            self._audience.say(f"{words} ({x:.2f}, {y:.2f}) m")

    def _end_run(self) -> None:
        """Pause, and let `run` return."""
        self._pause()
        # A run without a front end gets ahead of the pacer; a new one spares the next step the wait for that time.
        self._pacer = Pacer(self._pacer.rate)
        with self._wake:
            self._left = self._until = None
            self._wake.notify_all()

    def _call(self, function: Callable[..., object] | None, *arguments: object) -> object:
        """Call a function of the user. An exception stops the robot and is shown; `run` raises it again."""
        if function is None:
            return None
        try:
            return function(*arguments)
        except Exception as error:
            self.error = error
            last = traceback.extract_tb(error.__traceback__)[-1]
            self._audience.say(f"{type(error).__name__}: {error} (line {last.lineno} of {last.name})")
            self._end_run()
            return None

    def _measure(self, now: float) -> None:
        """Measure the speed of simulated time over the last half second."""
        since, elapsed = self._measured
        if now - since >= 0.5:
            self._speed = (self._elapsed - elapsed) / (now - since)
            self._measured = (now, self._elapsed)

    def _state(self) -> Message:
        if self._stopping:
            status = "stopped"
        elif self.error is not None:
            status = "failed"
        else:
            status = "running" if self._running else "paused"
        rate = None if math.isinf(self._pacer.rate) else self._pacer.rate
        return {"goal": self._goal, "status": status, "rate": rate, "speed": round(self._speed, 2)}

    def _start_thread(self) -> None:
        if self._stopping:
            raise RuntimeError("this live view has been stopped; make a new one")
        if self._thread is None:
            self._thread = threading.Thread(target=self._run_thread, name="live view", daemon=True)
            atexit.register(self.stop)
            self._thread.start()

    def _run_thread(self) -> None:
        wait: float | None = 0.0
        while True:
            with self._wake:
                if not (self._inbox or self._stopping or self._holders or self._changed or wait == 0.0):
                    self._wake.wait(wait)
                while self._holders and not self._stopping:
                    self._wake.wait()
                if self._stopping:
                    return
                self._changed = False
            wait = self.cycle(self._clock())

    def _apply(self, change: Callable[[], None]) -> None:
        with self.hold():
            change()
