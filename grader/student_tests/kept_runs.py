"""Keep runs of test modules from one check in a notebook to the next: only runs that an edit can change are repeated.

A run is found by a hash of all that decides it: the request, the package, the module itself, and the files beside the
tests. Another test module decides it only if the run has opened that. Gradings take no result from each other.
"""

from __future__ import annotations

import base64
import hashlib
import itertools
import json
import threading
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from grader.evidence.kept import Kept
from grader.sandbox import untrusted
from grader.student_tests.module_request import ModuleRequest
from grader.student_tests.worker_report import REPORTS, ModuleRun, read_run


@dataclass(frozen=True)
class _Report:
    """What a worker wrote in a run: the text of each file, by its suffix, and coverage's data as base64.

    `opened` maps the paths of the test modules that the run opened to hashes of their texts.
    """

    texts: dict[str, str]
    coverage: str
    seconds: float
    opened: dict[str, str]


class KeptRuns:
    """The kept runs of a package's tests. Safe to use from several threads.

    Args:
        kept: the storage.
        package: the package's source folder.
        program: a hash of everything of the package but its tests.
        folder: an empty folder in which the files of kept runs are written for a moment.
    """

    def __init__(self, kept: Kept, package: Path, program: str, folder: Path) -> None:
        self._kept, self._package, self._program, self._folder = kept, package, program, folder
        self._files = _test_files(package)
        self._asked: set[str] = set()
        self._new: dict[str, _Report] = {}
        self._numbers = itertools.count()
        self._lock = threading.Lock()
        self.found = 0
        """The number of runs that were taken from what is kept."""
        self.since = ""
        """When the first of them was run."""

    @property
    def asked(self) -> int:
        """Return the number of different runs that were asked for."""
        return len(self._asked)

    def find(self, request: ModuleRequest) -> ModuleRun | None:
        """Return the kept run for a request, None if there is none.

        Also None when this run is asked for again: that is done to see whether its results are steady.
        """
        key = self._key(request)
        with self._lock:
            if key in self._asked:
                return None
            self._asked.add(key)
        kept = self._kept.find(_Report, "run", key)
        if kept is None or any(self._files.get(path) != text for path, text in kept[0].opened.items()):
            return None
        with self._lock:
            self.found += 1
            self.since = min(self.since or kept[1], kept[1])
        return self._laid_out(request, kept[0])

    def note(self, request: ModuleRequest, out: Path, number: int, ran: ModuleRun) -> None:
        """Note the first run for a request, unless it may well go another way next time; its files are in `out`."""
        failed = any(test.outcome in ("failed", "error") for test in ran.tests if test.id.startswith(request.module))
        if ran.culprit or not ran.finished or (failed and not request.select):
            return
        texts = {suffix: untrusted.read_text(out / f"{number}.{suffix}", cap) for suffix, cap in REPORTS.items()}
        data = ran.coverage_data.read_bytes() if ran.coverage_data else b""
        report = _Report(
            {name: text for name, text in texts.items() if text is not None},
            base64.b64encode(data).decode(),
            ran.seconds,
            {path: text for path, text in self._files.items() if _is_opened(path, ran.opened)},
        )
        with self._lock:
            self._new.setdefault(self._key(request), report)

    def keep(self) -> None:
        """Store the runs that were noted so far."""
        while self._new:
            key, report = self._new.popitem()
            self._kept.keep(report, "run", key)

    def _laid_out(self, request: ModuleRequest, report: _Report) -> ModuleRun:
        number = next(self._numbers)
        paths = {suffix: self._folder / f"{number}.{suffix}" for suffix in report.texts}
        for suffix, text in report.texts.items():
            paths[suffix].write_text(text, encoding="utf-8", errors="surrogateescape", newline="")
        ran = read_run(self._folder, number, report.seconds, self._package / request.module)
        for path in paths.values():
            path.unlink()
        if not report.coverage:
            return ran
        data = self._folder / f"coverage.{number}"
        data.write_bytes(base64.b64decode(report.coverage))
        return replace(ran, coverage_data=data)

    def _key(self, request: ModuleRequest) -> str:
        """Return a hash of what decides a run, but for the other test modules that it opens, which `find` compares."""
        own = {request.module, *request.beside}
        seen = [f"{path} {text if path in own or not _is_module(path) else ''}" for path, text in self._files.items()]
        parts = [self._program, request.to_json(), json.dumps(sorted(request.files.items())), *seen]
        return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogateescape")).hexdigest()


def _test_files(package: Path) -> dict[str, str]:
    """Return hashes of all files in folders of tests, by their paths in the package."""
    hashes = {}
    for path in sorted(package.rglob("*")):
        relative = path.relative_to(package)
        if {"test", "tests"} & set(relative.parts) and "__pycache__" not in relative.parts and path.is_file():
            hashes[str(relative)] = hashlib.sha256(untrusted.read_bytes(path) or b"").hexdigest()
    return hashes


def _is_module(path: str) -> bool:
    name = PurePosixPath(path)
    return name.suffix == ".py" and (name.stem.startswith("test_") or name.stem.endswith("_test"))


def _is_opened(path: str, names: frozenset[str] | None) -> bool:
    return _is_module(path) and (names is None or PurePosixPath(path).stem in names)
