"""The thread in which a simulator runs: it obeys commands between two steps, keeps the speed, and ends a run.

No kernel and no widget; a notebook's view of it is `sim.live.view`.
"""

from __future__ import annotations

import atexit
import math
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Self

from sim.drive import Driver
from sim.live.audience import Audience, patience_s
from sim.live.commands import command
from sim.live.drivers import CONTROL_S, Drive, Guide
from sim.live.feed import Feed, Message, can_be_dragged
from sim.live.pacer import Pacer
from sim.obstacles import moved_to
from sim.scene import Scene
from sim.simulator import Simulator

ROOM_M = 0.01  # what is dragged keeps this distance from the hull


class Engine:
    """A simulator that runs beside whoever made it; see `Live` for the arguments.

    Whatever is asked of it is done between two steps, in whichever thread: `_lock` guards the simulator and all that
    belongs to it, `_wake` what the thread is woken for.
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
        self._audience = Audience(self._feed, fps)
        self._pacer = Pacer(rate)

        self._lock = threading.RLock()  # the simulator
        self._wake = threading.Condition()  # guards the four below
        self._inbox: list[Message] = []
        self._guests = 0
        self._stopping = False
        self._thread: threading.Thread | None = None
        self._seen_view = threading.Event()

        self._running = True
        self._unwatched = False  # runs though nobody watches
        self._left: float | None = None  # simulated seconds until it pauses by itself
        self._until: Callable[[], object] | None = None
        self._goal: list[float] | None = None
        self._guided = False  # our own driver is on its way there
        self._elapsed = self._speed = 0.0
        self._measured = (0.0, 0.0)

    # ------------------------------------------------------------- what its owner calls

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
        self._about_to_run()
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
        self._has_run()

    @contextmanager
    def hold(self) -> Iterator[Simulator]:
        """Give the simulator between two steps, to be changed from a cell: `with live.hold() as simulator: ...`."""
        with self._wake:
            self._guests += 1
        try:
            with self._lock:
                yield self.simulator
                self._audience.has_news = True
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
        self._has_stopped()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _about_to_run(self) -> None:
        """Do what is to be done before a run; for those who build on this class."""

    def _has_run(self) -> None:
        """Do what is to be done after a run that went well; for those who build on this class."""

    def _has_stopped(self) -> None:
        """Do what is to be done at the end; for those who build on this class."""

    # ------------------------------------------------------------- commands

    def receive(self, content: object) -> None:
        """Take a message from the browser; it is obeyed between two steps. What is no command is left alone."""
        order = command(content)
        if order is None:
            return
        if "view" in order:
            order["patience"] = patience_s(order["hidden"])
            self._seen_view.set()
        with self._wake:
            self._inbox.append(order)
            self._wake.notify_all()

    def _take(self) -> list[Message]:
        """Return the commands that came; of several moves of one obstacle only the last."""
        with self._wake:
            commands, self._inbox = self._inbox, []
        last = {c["name"]: i for i, c in enumerate(commands) if c["kind"] == "move"}
        return [c for i, c in enumerate(commands) if c["kind"] != "move" or last[c["name"]] == i]

    def _obey(self, order: Message, now: float) -> None:
        match order:
            case {"kind": "hello" | "alive" as kind, "view": view, "patience": patience}:
                self._audience.hear(view, now + patience, begins=kind == "hello")
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
        self._goal = None
        self._guided = False
        if self._drive is not None:
            if self._has_guide:
                self._drive.driver = self._new_guide()
            self._drive.restart()
        self._call(self._on_reset)
        self._audience.say("back at the start")

    def _new_guide(self) -> Guide:
        return Guide(self.simulator)

    def _go_to(self, x: float, y: float) -> None:
        self._goal = [x, y]
        if self._on_goal is not None:
            answer = self._call(self._on_goal, x, y)
            self._audience.say(answer if isinstance(answer, str) else f"goal sent: ({x:.2f}, {y:.2f}) m")
        elif self._drive is not None and isinstance(self._drive.driver, Guide):
            self._drive.driver.go_to(x, y)
            self._guided = True
            self._audience.say(f"driving to ({x:.2f}, {y:.2f}) m")
        else:
            self._goal = None
            self._audience.say("a click does nothing here: give Live an on_goal function")

    def _move(self, name: str, x: float, y: float) -> None:
        """Put an obstacle elsewhere, unless the robot is there."""
        obstacle = next((o for o, _ in self.simulator.obstacles if o.name == name and can_be_dragged(o)), None)
        if obstacle is None:
            return
        robot = self.simulator.pose
        nearest = Scene([moved_to(obstacle, (x, y))]).nearest(robot.x, robot.y)
        if nearest is not None and nearest.distance < self.simulator.profile.radius + ROOM_M:
            self._audience.say(f"{name} cannot stand where the robot is")
            return
        self.simulator.move_obstacle(name, x, y)
        self._audience.has_news = True

    # ------------------------------------------------------------- the thread

    def turn(self, now: float) -> float | None:
        """Obey what came, make the step that is due, send what is due; `now` is wall time in s.

        Return the seconds until there is something to do again, None if only a command can bring that about.
        """
        with self._lock:
            for order in self._take():
                self._obey(order, now)
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
        wanted = self._unwatched or self._audience.is_there or self._left is not None
        return self._running and wanted and self.error is None and not self._stopping

    def _wait(self, now: float) -> float:
        # In `run` without a front end nobody needs the wished speed.
        return 0.0 if self._left is not None and not self._audience.is_there else self._pacer.wait(now)

    def _advance(self) -> None:
        self._call(self._step, self._period)
        self._feed.follow()
        self._elapsed += self._period
        self._say_when_there()
        if self._left is not None:
            self._left -= self._period
            if self._left < 1e-9 or (self._until is not None and self._call(self._until)):
                self._end_run()

    def _say_when_there(self) -> None:
        guide = self._drive.driver if self._drive is not None else None
        if self._guided and self._goal is not None and isinstance(guide, Guide) and guide.has_arrived():
            self._guided = False
            x, y = self._goal
            self._audience.say(f"arrived at ({x:.2f}, {y:.2f}) m")

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
            self._audience.say(f"{type(error).__name__}: {error} (line {last.lineno} of {last.name})")
            self._end_run()
            return None

    def _measure(self, now: float) -> None:
        """Note how fast simulated time has gone during the last half second."""
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
