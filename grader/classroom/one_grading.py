"""Grade one submission in a process of its own, so that nothing that happens to it reaches another.

The parent writes the order to the child's standard input. When the parent dies, however it dies, the child ends itself
and its sandboxes, and removes its temporary files (processes/supervised.py).
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import cattrs

from grader import KIT
from grader.classroom.class_folder import Status
from grader.errors import GraderError, SubmissionError
from grader.host import shortage, tempdir
from grader.processes import supervised
from grader.settings import Reuse

_RESULT = "result: "


@dataclass(frozen=True)
class Order:
    """What to grade and how, all of it plain: it travels as JSON.

    `fresh` collects all evidence anew.
    After `limit_s` seconds of wall time it is ended.
    `source` is an archive or a folder, `rubric` the text of a rubric, `hand_in` the fields of a HandIn, `course` a name
    as `grader.course.named` reads it. `package` is the path of the package to grade, "" for the grader's choice.
    """

    id: str
    source: str
    out: str
    rubric: str
    seed: int
    hand_in: dict[str, Any] = field(default_factory=dict)
    fresh: bool = False
    course: str = ""
    package: str = ""
    limit_s: float = 3600.0


@dataclass(frozen=True)
class Ending:
    """How a grading ended; `why` says why there is no grade. `seconds` of wall time."""

    status: Status
    why: str = ""
    seconds: float = 0.0


class Runner:
    """Starts gradings and can end all of them at once. Its methods may be called from several threads."""

    def __init__(self, progress: Callable[[str, str], None] = lambda _id, _what: None) -> None:
        """`progress` is called with a submission's id and a few words whenever something new begins."""
        self._progress = progress
        self._running: set[subprocess.Popen[str]] = set()
        self._lock = threading.Lock()
        self._stopped = False

    def grade(self, order: Order, scratch: Path | None = None) -> Ending:
        """Grade one submission into the folder `order.out` and return how it ended. It raises nothing.

        The folder `scratch` is removed if this process is killed.
        """
        started = time.monotonic()
        try:
            ending = self._run(order, scratch)
        except OSError as error:
            ending = Ending(Status.ERROR, shortage.explain(error) or f"The grading cannot be started ({error}).")
        seconds = time.monotonic() - started
        if ending.status is Status.ERROR and seconds >= order.limit_s:
            why = f"It was not done after {order.limit_s / 60:g} minutes (--minutes): look at it, or give it more."
            return Ending(Status.ERROR, why, seconds)
        return Ending(ending.status, ending.why, seconds)

    def _run(self, order: Order, scratch: Path | None) -> Ending:
        with self._lock:
            if self._stopped:
                return Ending(Status.ERROR, "interrupted")
            child = subprocess.Popen(
                [sys.executable, "-m", "grader.classroom.one_grading", str(os.getpid()), str(scratch or "")],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                start_new_session=True, cwd=KIT,
            )  # fmt: skip
            self._running.add(child)
        limit = threading.Timer(order.limit_s, supervised.end, [child])
        limit.daemon = True
        limit.start()
        try:
            return self._follow(child, order)
        finally:
            limit.cancel()
            supervised.end(child)
            with self._lock:
                self._running.discard(child)

    def stop(self) -> None:
        """End all gradings that are going on; no other will begin."""
        with self._lock:
            self._stopped = True
            running = list(self._running)
        with ThreadPoolExecutor(len(running) or 1) as threads:  # each waits until its processes are gone
            list(threads.map(supervised.end, running))

    def _follow(self, child: subprocess.Popen[str], order: Order) -> Ending:
        assert child.stdin is not None
        assert child.stdout is not None
        with contextlib.suppress(BrokenPipeError), child.stdin:
            child.stdin.write(json.dumps(asdict(order)))
        last, ending = "", None
        for line in child.stdout:
            if line.startswith(_RESULT):
                status, why = json.loads(line.removeprefix(_RESULT))
                ending = Ending(Status(status), why)
            else:
                last = line.strip() or last
                self._progress(order.id, line.strip())
        code = child.wait()
        if ending is not None:
            return ending
        how = f"killed by signal {-code}" if code < 0 else f"ended with status {code}"
        return Ending(Status.ERROR, f"The process that graded it was {how}; its last words: {last[:300] or 'none'}")


class Workforce:
    """Grades up to `slots` submissions at a time: on this machine, or on a cluster.

    Attributes:
        doing: what is going on, by the ids of the submissions that are being graded.
    """

    def __init__(self, slots: int, grade: Callable[[Order], Ending], end: Callable[[], None], words: str = "") -> None:
        """`end` ends all that `grade` is doing; `words` say at first what is going on."""
        self.slots = slots
        self._grade, self._end, self._words = grade, end, words
        self.doing: dict[str, str] = {}
        self._threads = ThreadPoolExecutor(slots)

    def submit(self, order: Order) -> Future[Ending]:
        """Begin a grading into the folder `order.out`; the future never raises for the submission's sake."""
        return self._threads.submit(self._noted, order)

    def stop(self) -> None:
        """End everything at once."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._end()
        self._threads.shutdown(wait=True)

    def _noted(self, order: Order) -> Ending:
        self.doing[order.id] = self._words
        try:
            return self._grade(order)
        finally:
            del self.doing[order.id]


def _grade(order: Order) -> None:
    # Imported here: a parent that only starts children needs none of it.
    from grader import building, pipeline, report
    from grader.course import named
    from grader.scoring import rubric
    from grader.scoring.grading import HandIn

    with tempfile.NamedTemporaryFile("w", suffix=".yaml", encoding="utf-8") as file:
        file.write(order.rubric)
        file.flush()
        settings = pipeline.Settings(
            rubric=rubric.load(Path(file.name)),
            course=named(order.course),
            cache=building.cache_folder(),
            seed=order.seed,
            package_path=order.package,
            reuse=Reuse.unless(order.fresh),
            progress=lambda what: print(what.replace("\n", " "), flush=True),
        )
    hand_in = cattrs.structure(order.hand_in, HandIn)
    pipeline.grade(Path(order.source), Path(order.out), settings, write=partial(report.write, hand_in=hand_in))


def _carry_out(order: Order) -> int:
    """Grade, and print how it ended."""
    ending = [Status.GRADED.value, ""]
    try:
        _grade(order)
    except SubmissionError as error:
        ending = [Status.REFUSED.value, str(error)]
    except GraderError as error:
        ending = [Status.ERROR.value, str(error)]
    except Exception as error:
        ending = [Status.ERROR.value, f"internal error: {type(error).__name__}: {error}"]
    print(_RESULT + json.dumps(ending), flush=True)
    return 0


def main() -> int:
    """Carry out the order on standard input.

    The arguments are the pid of the process that gives it, and a folder to remove if that ends, or "".
    """
    parent, scratch = int(sys.argv[1]), sys.argv[2]
    order = Order(**json.loads(supervised.read_task()))
    try:
        return supervised.run(lambda: _carry_out(order), parent)
    except KeyboardInterrupt:
        if scratch:
            tempdir.remove(Path(scratch))
        return 130
    except GraderError as error:
        print(_RESULT + json.dumps([Status.ERROR.value, str(error)]), flush=True)
        return 1


if __name__ == "__main__":
    sys.exit(main())
