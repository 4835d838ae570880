"""What a worker reports of one run. Every byte may come from the submission, so all is capped and checked."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from grader.sandbox import untrusted
from grader.student_tests import package_modules

_REACH_CAP = 30_000_000  # bytes: a thousand tests that each reach a thousand lines
_TAIL = 2000
_STARTS = re.compile(r"ros2|python[\d.]*|(ba|da)?sh|env|timeout|xvfb-run|stdbuf")


@dataclass(frozen=True)
class TestResult:
    """What pytest reported of one test: "passed", "failed", "error" or "skipped"; `xfail` for an expected failure."""

    __test__ = False

    id: str
    outcome: str
    message: str = ""
    seconds: float = 0.0
    xfail: bool = False


@dataclass(frozen=True)
class ModuleRun:
    """How one run of a test module went."""

    tests: tuple[TestResult, ...]
    collected: tuple[str, ...]
    collection_error: str
    finished: bool
    """Whether pytest came to its own end."""
    status: int
    timed_out: str
    """The test that was stopped for its time, "collection" or ""."""
    running: str
    """The test that was running, or had run last, when the process ended; "" if none had started."""
    seconds: float
    quiet_seconds: float
    """Without the time in which other processes had the cores: what it would have taken on a quiet machine."""
    shares_fixtures: bool
    output_tail: str
    reach: Mapping[str, Mapping[int, frozenset[str]]]
    """The tests that reached each line of each module; "" stands for importing and for shared fixtures."""
    imported: Mapping[str, frozenset[int]] = field(default_factory=dict)
    """The lines of each module that ran while the package was imported, and in nothing else but tests."""
    started: frozenset[str] = frozenset()
    """The command lines of the programs that the tests have started."""
    coverage_data: Path | None = None
    """A copy of coverage's data as it was when the run ended; no later test can change it. None where the run was cut
    off before it could say which test reached what."""

    worker_lost: bool = False
    """Whether the worker has ended in this run, which only a test brings about."""

    @property
    def culprit(self) -> str:
        """Return the test that hung, or with which the process ended before its time; "" if there is none."""
        return self.timed_out or ("" if self.finished else self.running)

    @property
    def failure(self) -> str:
        """Return the first test that did not pass or was not there to pass, "" if all passed."""
        for test in self.tests:
            if test.outcome in ("failed", "error"):
                return test.id
        if self.timed_out:
            return self.timed_out
        if self.collection_error or not self.finished:
            return "collection" if not self.tests else "the end of the run"
        return ""


def read_run(out: Path, number: int, seconds: float) -> ModuleRun:
    """Return what the worker wrote to `out` for run `number`; it took `seconds` of wall time."""
    done = _json_object(untrusted.read_text(out / f"{number}.done") or "")
    entries = [_json_object(line) for line in (untrusted.read_text(out / f"{number}.report") or "").splitlines()]
    reached = _json_object(untrusted.read_text(out / f"{number}.reach", _REACH_CAP) or "")
    collected = tuple(_texts(next((e["collected"] for e in entries if "collected" in e), [])))
    return ModuleRun(
        tests=tuple(_tests(entries)),
        collected=collected,
        collection_error="; ".join(_text(entry.get("message"), 400) for entry in entries if "broken" in entry)[:800],
        finished=any("ended" in entry for entry in entries) and done.get("status") == 0,
        status=_int(done.get("status"), -1),
        timed_out=_text(done.get("late")),
        running=next((_text(entry["start"]) for entry in reversed(entries) if "start" in entry), ""),
        seconds=seconds,
        quiet_seconds=max(seconds - _number(done.get("queued")), 0.0),
        shares_fixtures=any("shared" in entry for entry in entries),
        output_tail=(untrusted.read_text(out / f"{number}.log") or "")[-_TAIL:].encode("utf-8", "replace").decode(),
        reach=_reach(reached),
        imported=_imported(reached),
        started=frozenset(_text(entry["starts"], 1000) for entry in entries if "starts" in entry),
    )


def _tests(entries: Sequence[dict[str, Any]]) -> Iterator[TestResult]:
    """Yield one result for each test that has ended or begun to fail, in order."""
    found: dict[str, TestResult] = {}
    for entry in entries:
        if not isinstance(name := entry.get("id"), str):
            continue
        name = name[:300]
        outcome, when = entry.get("outcome"), entry.get("when")
        seconds = _number(entry.get("seconds")) + (found[name].seconds if name in found else 0.0)
        before = found.get(name)
        if outcome == "failed" and (before is None or before.outcome not in ("failed", "error")):
            kind = "failed" if when == "call" else "error"
            found[name] = TestResult(name, kind, _text(entry.get("message"), 400), seconds)
        elif outcome == "skipped" and before is None:
            found[name] = TestResult(
                name, "skipped", _text(entry.get("message"), 400), seconds, bool(entry.get("xfail"))
            )
        elif outcome == "passed" and when == "call" and before is None:
            found[name] = TestResult(name, "passed", seconds=seconds, xfail=bool(entry.get("xfail")))
        elif before is not None:
            found[name] = TestResult(name, before.outcome, before.message, seconds, before.xfail)
    return iter(found.values())


def started_nodes(command: str, nodes: Iterable[str]) -> Iterator[str]:
    """Yield which of the nodes a command line starts: by `ros2 run` or `launch`, Python, or themselves."""
    words = [PurePosixPath(word).name for word in re.findall(r"[\w./-]+", command)]
    first = words[0] if words else ""
    for node in nodes:
        known = {node, f"{node}.py", f"{node}_launch.py"}
        named = any(word in known or word.endswith(f".{node}") for word in words)
        if first == node or (named and _STARTS.fullmatch(first)):
            yield node


def _imported(data: dict[str, Any]) -> dict[str, frozenset[int]]:
    files = data.get("imported")
    found: dict[str, frozenset[int]] = {}
    for name, lines in files.items() if isinstance(files, dict) else ():
        if isinstance(lines, list) and (path := package_modules.relative(Path(name))) is not None:
            found[path] = found.get(path, frozenset()).union(_int(line, 0) for line in lines)
    return found


def _reach(data: dict[str, Any]) -> dict[str, dict[int, frozenset[str]]]:
    tests = _texts(data.get("tests"))
    files = data.get("reach")
    found: dict[str, dict[int, frozenset[str]]] = {}
    for name, lines in files.items() if isinstance(files, dict) else ():
        path = package_modules.relative(Path(name))
        if path is None or not isinstance(lines, dict):
            continue
        by_line = found.setdefault(path, {})
        for line, numbers in lines.items():
            # `isdigit` accepts "²", and Python refuses to convert more than 4300 digits.
            if re.fullmatch("[0-9]{1,7}", line) and isinstance(numbers, list):
                names = {tests[n] if n >= 0 else "" for n in numbers if isinstance(n, int) and -1 <= n < len(tests)}
                by_line[int(line)] = by_line.get(int(line), frozenset()) | frozenset(names)
    return found


def _json_object(text: str) -> dict[str, Any]:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError, MemoryError):
        return {}
    return data if isinstance(data, dict) else {}


def _text(value: Any, cap: int = 300) -> str:
    return value[:cap].encode("utf-8", "replace").decode() if isinstance(value, str) else ""


def _texts(value: Any) -> list[str]:
    return [_text(item) for item in value if isinstance(item, str)] if isinstance(value, list) else []


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) and 0 <= value < 1e6 else 0.0


def _int(value: Any, otherwise: int) -> int:
    return value if isinstance(value, int) and abs(value) < 1e6 else otherwise
