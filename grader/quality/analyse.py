"""Read a package with our own reader, then with ROS's linters, and put what they say together."""

from __future__ import annotations

import json
import re
import subprocess
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import ament_flake8

from grader import evidence
from grader.errors import GraderError
from grader.evidence import Definition, Finding, Manifest, Quality, SourceFile, reading_limits
from grader.quality import bisect_failures, source_files
from grader.quality.source_files import Source
from grader.quality.unreadable import definitions as definitions_of_unreadable
from grader.sanitize import printable

# flake8's own rules. With ROS from apt, ament_flake8 brings plugins for quotes, import order and more; the wheels do
# not depend on them, so a student who runs ament_flake8 here is not told of those, and they cost nothing.
_RULES = re.compile(r"[EWF]\d")
_CONFIGURATION = Path(ament_flake8.__file__).parent / "configuration" / "ament_flake8.ini"
MOST_COMPLEX = 10
_LINE = re.compile(r"^(?:\./)?(\d{4}/[^:]+):(\d+):([A-Z]+\d+):(.*)$")
_MOST_FINDINGS = 500

_Found = tuple[str, int, int, str, str]


def analyse_package(package: Path, interfaces: Path | None = None, *, lint: bool = True) -> Quality:
    """Return what the text of `package` shows. Nothing of it is run; what cannot be read is said so.

    Without `lint` nothing is said of style and docstrings: package.xml needs no linter, and they take most of the time.

    Raises:
        GraderError: a tool of ours is missing or broken.
    """
    with tempfile.TemporaryDirectory(prefix="quality-") as scratch:
        room = Path(scratch)
        every = source_files.copy(source_files.find(package), room)
        good = [source for source in every if not source.problem]
        found, unreadable = _facts(package, interfaces, good, room)
        # What is no Python would only tell a linter's weak spots: it is not shown to them.
        readable = {file.path for file in found.files if not file.problem} - {source.path for source in unreadable}
        good = [source for source in good if source.path in readable] if lint else []
        with ThreadPoolExecutor(2) as pool:
            style = pool.submit(bisect_failures.run_without_culprits, lambda items: _flake8(items, room), good)
            docstrings = pool.submit(bisect_failures.run_without_culprits, lambda items: _pep257(items, room), good)
            return _together(found, every, unreadable, style.result(), docstrings.result())


def _flake8(items: Sequence[Source], room: Path) -> list[Finding] | None:
    """Return what flake8 finds under ament_flake8's configuration, and functions that are too complex."""
    if not items:
        return []
    done = bisect_failures.python(
        [
            "-m", "flake8", f"--config={_CONFIGURATION}", "--disable-noqa", "--no-show-source", "--jobs=1",
            f"--max-complexity={MOST_COMPLEX}",
            "--format=%(path)s:%(row)d:%(code)s:%(text)s", *(item.copy for item in items),
        ],
        room,
    )  # fmt: skip
    if done is None or done.returncode not in (0, 1):
        _complain_if_broken("flake8", done)
        return None
    by_copy = {item.copy: item for item in items}
    found = []
    for line in done.stdout.splitlines():
        match = _LINE.match(line)
        if match and match.group(1) in by_copy:
            path, number, rule, words = match.groups()
            found.append(Finding(by_copy[path].path, int(number), rule, printable(words.strip())))
    if done.returncode == 1 and not found:
        _complain_if_broken("flake8", done)
        return None
    return found


def _pep257(items: Sequence[Source], room: Path) -> list[_Found] | None:
    """Return what ament_pep257's rules find: (path, line of the definition, line, rule, words)."""
    if not items:
        return []
    done = bisect_failures.python(["-m", "grader.quality.pep257", *(item.copy for item in items)], room)
    if done is None or done.returncode:
        _complain_if_broken("pydocstyle", done)
        return None
    by_copy = {item.copy: item for item in items}
    return [
        (by_copy[path].path, start, line, rule, printable(words))
        for path, start, line, rule, words in json.loads(done.stdout)
    ]


def _complain_if_broken(tool: str, done: subprocess.CompletedProcess[str] | None) -> None:
    """Say so if it is the tool that does not work at all, and not the text that was too much for it."""
    said = done.stdout[-500:] + done.stderr[-500:] if done else ""
    if any(sign in said for sign in ("No module named", "required plugins", "ImportError", "config file does not")):
        raise GraderError(f"{tool} does not work on this machine: {said.strip()}. Run `make setup`.")


def _facts(package: Path, interfaces: Path | None, good: Sequence[Source], room: Path) -> tuple[Quality, list[Source]]:
    beside = str(interfaces.resolve()) if interfaces else ""

    def run(items: Sequence[Source]) -> Quality | None:
        listing = room / f"sources-{len(items)}-{items[0].copy[:4] if items else ''}.json"
        listing.write_text(json.dumps([[item.path, item.copy] for item in items]))
        done = bisect_failures.python(
            ["-m", "grader.quality.worker", str(package.resolve()), beside, str(listing)], room
        )
        if done is None or done.returncode:
            _complain_if_broken("the reader", done)
            return None
        return evidence.from_json(done.stdout, Quality)

    found, unreadable = bisect_failures.run_without_culprits(run, good)
    if found is None:
        found = run([]) or Quality(manifest=Manifest(found=False, problems=["package.xml could not be read"]))
    return found, unreadable


def _together(
    found: Quality,
    every: Sequence[Source],
    unreadable: Sequence[Source],
    style: tuple[list[Finding] | None, list[Source]],
    docstrings: tuple[list[_Found] | None, list[Source]],
) -> Quality:
    too_much = {source.path for source in (*unreadable, *style[1], *docstrings[1])}
    files = {file.path: file for file in found.files}
    for source in every:
        known = files.get(source.path)
        problem = source.problem or (known.problem if known else "")
        if not problem and source.path in too_much:
            problem = "too much for the tools: they ran out of time or memory on it"
        lines = known.lines if known and not problem else source.rough_lines
        files[source.path] = SourceFile(printable(source.path), lines, problem)
    readable = {path for path, file in files.items() if not file.problem}
    linted = [finding for finding in style[0] or [] if finding.path in readable]
    rules = [finding for finding in linted if _RULES.match(finding.rule)]
    public = [thing for thing in found.definitions if thing.path in readable]
    # What hides in a file that cannot be read is not thereby documented.
    hidden = [
        thing
        for source in every
        if source.path not in readable
        for thing in definitions_of_unreadable(printable(source.path), source.data)
    ]
    return replace(
        found,
        files=[files[path] for path in sorted(files)],
        style=rules[:_MOST_FINDINGS],
        style_count=len(rules),
        complex=[finding for finding in linted if finding.rule == "C901"][:_MOST_FINDINGS],
        suppressions=[
            Finding(printable(source.path), line, "suppression", printable(words))
            for source in every
            for line, words in source.suppressions()
        ][:_MOST_FINDINGS],
        definitions=_with_faults(public, docstrings[0] or []) + hidden[: reading_limits.MOST_DEFINITIONS],
    )


def _with_faults(definitions: Sequence[Definition], found: Sequence[_Found]) -> list[Definition]:
    """Return the definitions, each with what its docstring breaks."""
    faults: dict[tuple[str, int], list[Finding]] = {}
    for path, start, line, rule, words in found:
        faults.setdefault((path, start), []).append(Finding(path, line, rule, words))
    taken = []
    for item in definitions:
        # A module and its first definition may both begin on line 1; pydocstyle tells them apart by the same lines.
        taken.append(replace(item, violations=faults.get((item.path, item.line), [])[:5]))
    return taken
