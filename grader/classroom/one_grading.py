"""Grade one submission in a process of its own, so that nothing that happens to it reaches another.

The parent writes the order to the child's standard input and keeps the pipe open: when the parent dies, however it
dies, the child reads the pipe's end, ends itself and its sandboxes, and has its temporary files removed.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import cattrs

from grader import KIT
from grader.classroom.class_folder import Status
from grader.errors import GraderError, SubmissionError
from grader.host import cgroup, procfs, shortage, tempdir

_RESULT = "result: "
# Removes a folder a moment after the process that starts it has killed itself and its group.
_REMOVE_LATER = """
for round in 1 2 3 4 5 6 7 8 9 10; do
    sleep 0.3
    chmod -R u+rwX "$1"
    rm -rf "$1"
    [ -e "$1" ] || exit 0
done
"""


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
    cache: str
    mutation_budget_s: float
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

        All temporary files are in `scratch`, or in a new folder. It is removed if this process is killed.
        """
        started = time.monotonic()
        try:
            with tempdir.folder("batch") if scratch is None else nullcontext(scratch) as temporary:
                ending = self._run(order, temporary)
        except OSError as error:
            ending = Ending(Status.ERROR, shortage.explain(error) or f"The grading cannot be started ({error}).")
        return Ending(ending.status, ending.why, time.monotonic() - started)

    def _run(self, order: Order, temporary: Path) -> Ending:
        with self._lock:
            if self._stopped:
                return Ending(Status.ERROR, "interrupted")
            child = subprocess.Popen(
                [sys.executable, "-m", "grader.classroom.one_grading"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                start_new_session=True, cwd=KIT, env=os.environ | {"TMPDIR": str(temporary)},
            )  # fmt: skip
            self._running.add(child)
        out_of_time = threading.Event()

        def stop() -> None:
            out_of_time.set()
            _end(child)

        limit = threading.Timer(order.limit_s, stop)
        limit.daemon = True
        limit.start()
        try:
            ending = self._follow(child, order)
        finally:
            limit.cancel()
            _end(child)
            with self._lock:
                self._running.discard(child)
        if out_of_time.is_set() and ending.status is Status.ERROR:
            why = f"It was not done after {order.limit_s / 60:g} minutes (--minutes): look at it, or give it more."
            return Ending(Status.ERROR, why)
        return ending

    def stop(self) -> None:
        """End all gradings that are going on; no other will begin."""
        with self._lock:
            self._stopped = True
            running = list(self._running)
        with ThreadPoolExecutor(len(running) or 1) as threads:  # each waits until its processes are gone
            list(threads.map(_end, running))

    def _follow(self, child: subprocess.Popen[str], order: Order) -> Ending:
        assert child.stdin is not None
        assert child.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            child.stdin.write(json.dumps(asdict(order)) + "\n")
            child.stdin.flush()
        last = ""
        for line in child.stdout:
            if line.startswith(_RESULT):
                status, why = json.loads(line.removeprefix(_RESULT))
                return Ending(Status(status), why)
            last = line.strip() or last
            self._progress(order.id, line.strip())
        code = child.wait()
        how = f"killed by signal {-code}" if code < 0 else f"ended with status {code}"
        return Ending(Status.ERROR, f"The process that graded it was {how}; its last words: {last[:300] or 'none'}")


def grade_packed(
    order: dict[str, object], archive: bytes, folder: bool, runner: Runner | None = None
) -> tuple[str, str, float, bytes]:
    """Grade a submission that travels as bytes, and return status, reason, seconds and a zip of the results.

    For a worker on another machine: it shares no disk with the caller. `folder` says that the archive is a packed
    folder. A cache folder that the order leaves empty is this machine's own. `runner` can end it from another thread.
    """
    with tempdir.folder("batch") as scratch:
        source = scratch / "in" / Path(str(order["source"])).name
        if folder:
            _unzip(archive, source)
        else:
            source.parent.mkdir(parents=True)
            source.write_bytes(archive)
        out = scratch / "out"
        out.mkdir()
        local = Order(**(order | {"source": str(source), "out": str(out)}))  # type: ignore[arg-type]  # from asdict
        ending = (runner or Runner()).grade(local, scratch)
        return ending.status.value, ending.why, ending.seconds, pack(out)


def pack(folder: Path) -> bytes:
    """Return the files of a folder as a zip; links and special files are left out."""
    stream = io.BytesIO()
    # A zip has no times before 1980; a file from a reproducible build may be of 1970.
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False) as packed:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and not path.is_symlink() and ".git" not in path.relative_to(folder).parts:
                packed.write(path, path.relative_to(folder).as_posix())
    return stream.getvalue()


def unpack_results(packed: bytes, into: Path) -> None:
    """Write what `grade_packed` returned into the folder `into`."""
    _unzip(packed, into)


def _unzip(packed: bytes, into: Path) -> None:
    into.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        archive.extractall(into)  # of our own making; zipfile drops ".." and absolute paths
        for entry in archive.infolist():  # and modes, without which an executable is none
            (into / entry.filename).chmod(entry.external_attr >> 16 & 0o777)


def _end(child: subprocess.Popen[str]) -> None:
    """Kill a child with all processes below it, and wait until they are gone."""
    with contextlib.suppress(ProcessLookupError):
        if child.poll() is None:
            below = procfs.descendants(child.pid)
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            procfs.kill(below)
            cgroup.sweep()
    child.wait()
    for stream in (child.stdin, child.stdout):
        if stream is not None:
            with contextlib.suppress(OSError):
                stream.close()


def _die_with_parent() -> None:
    """End this process group, and remove its temporary folder, as soon as standard input is closed."""

    def watch() -> None:
        while sys.stdin.buffer.read(1):
            pass
        quiet = [(os.POSIX_SPAWN_OPEN, stream, os.devnull, os.O_RDWR, 0) for stream in (0, 1, 2)]
        remove = ["sh", "-c", _REMOVE_LATER, "sh", os.environ["TMPDIR"]]
        os.posix_spawn("/bin/sh", remove, {"PATH": os.defpath}, file_actions=quiet, setsid=True)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()


def _grade(order: Order) -> Ending:
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
            cache=Path(order.cache) if order.cache else building.cache_folder(),
            seed=order.seed,
            mutation_budget_s=order.mutation_budget_s,
            package_path=order.package,
            keep=True,
            fresh=order.fresh,
            progress=lambda what: print(what.replace("\n", " "), flush=True),
        )
    try:
        hand_in = cattrs.structure(order.hand_in, HandIn)
        pipeline.grade(Path(order.source), Path(order.out), settings, write=partial(report.write, hand_in=hand_in))
    except SubmissionError as error:
        return Ending(Status.REFUSED, str(error))
    except GraderError as error:
        return Ending(Status.ERROR, str(error))
    return Ending(Status.GRADED)


def main() -> None:
    """Read an order from standard input, carry it out, and print how it ended."""
    order = Order(**json.loads(sys.stdin.buffer.readline()))
    _die_with_parent()
    try:
        ending = _grade(order)
    except Exception as error:
        ending = Ending(Status.ERROR, f"internal error: {type(error).__name__}: {error}")
    print(_RESULT + json.dumps([ending.status.value, ending.why]), flush=True)


if __name__ == "__main__":
    main()
