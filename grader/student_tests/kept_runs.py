"""Runs of the package's own tests, kept by all that decides them: after an edit of one module only its runs are new.

Of the other test modules those decide a run that it was seen to open. For the checks in a notebook: a grading takes no
run's result from another grading.
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

    `opened` are the test modules that the run opened, and their texts' hashes.
    """

    texts: dict[str, str]
    coverage: str
    seconds: float
    opened: dict[str, str]


class KeptRuns:
    """Runs to be taken from `kept` instead of a worker. Safe to use from several threads.

    Args:
        kept: what is kept from one check to the next.
        package: the package's source folder.
        program: a hash of everything of the package but its tests.
        folder: where files of kept runs are laid out, an empty folder.
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
        """Return a run that was kept for a request; None where it is asked for again, to see whether it is steady."""
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
        """Remember the first run for a request, unless it is worth another try; its files are in `out`."""
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
        """Keep what was noted so far, for later checks."""
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
        """Return a hash of what decides a run: the request, the package, and all of its tests but other modules."""
        own = {request.module, *request.beside}
        seen = [f"{path} {text if path in own or not _is_module(path) else ''}" for path, text in self._files.items()]
        parts = [self._program, request.to_json(), json.dumps(sorted(request.files.items())), *seen]
        return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogateescape")).hexdigest()


def _test_files(package: Path) -> dict[str, str]:
    """Return hashes of all files in folders of tests, by their paths in the package."""
    found = {}
    for path in sorted(package.rglob("*")):
        relative = path.relative_to(package)
        if {"test", "tests"} & set(relative.parts) and "__pycache__" not in relative.parts and path.is_file():
            found[str(relative)] = hashlib.sha256(untrusted.read_bytes(path) or b"").hexdigest()
    return found


def _is_module(path: str) -> bool:
    name = PurePosixPath(path)
    return name.suffix == ".py" and (name.stem.startswith("test_") or name.stem.endswith("_test"))


def _is_opened(path: str, names: frozenset[str] | None) -> bool:
    return _is_module(path) and (names is None or PurePosixPath(path).stem in names)
