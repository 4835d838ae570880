"""The package's text as a source of evidence: read by our own worker and by ROS's linters."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

from grader import building, evidence
from grader.course import Course
from grader.errors import GraderError
from grader.evidence import Flag, Manifest, Quality, SourceFile, reading_limits
from grader.processes.jobs import Job, Where
from grader.quality import source_files
from grader.quality.source_files import PythonFile
from grader.sandbox import untrusted
from grader.sanitize import printable
from grader.source import Asked, Collected, Phase, Source, Subject, served
from grader.words import mark, say

T = TypeVar("T")
R = TypeVar("R")
CPU_SECONDS = 60  # a whole package takes 1 to 2, one at the reading limits 20
_WALL_SECONDS = 300.0  # far above, for a busy machine: the limit on CPU time is the one that decides
_MAX_MEMORY = 2 * 1024**3  # bytes
_SEARCH_SECONDS = 120.0


def analyse_package(
    package: Path,
    course: Course,
    interfaces: Path | None = None,
    left: Mapping[str, Path] = MappingProxyType({}),
    *,
    lint: bool = True,
) -> Quality:
    """Return the facts of the text of `package`, with the reason for each file that cannot be read. Nothing is run.

    `left` are files of the build's own that are part of it, by the paths that they have in the package; one takes the
    place of a file that was handed in there. Without `lint`, style and docstrings are left out: package.xml needs no
    linter, and they take most of the time.

    Raises:
        GraderError: a tool of the grader is missing or broken.
    """
    with tempfile.TemporaryDirectory(prefix="quality-") as name:
        scratch = Path(name)
        sources = source_files.find_in_both(package, interfaces, course)
        made = [(path, untrusted.read_bytes(file) or b"") for path, file in left.items()]
        sources = [source for source in sources if source.path not in left] + source_files.within_limits(made)
        every = source_files.copy(sorted(sources, key=lambda source: source.path), scratch)
        beside = str(interfaces.resolve()) if interfaces else ""

        def run(items: Sequence[PythonFile]) -> Quality | None:
            listing = scratch / "sources.json"
            listing.write_text(json.dumps([[item.path, item.copy] for item in items]))
            arguments = [str(course.folder), str(package.resolve()), beside, str(listing), *["--lint"] * lint]
            done = run_python(["-m", "grader.quality.worker", *arguments], scratch)
            if done is None or done.returncode:
                _raise_if_broken(done)
                return None
            return evidence.from_json(done.stdout, Quality)

        facts, unreadable = run_without_culprits(run, [source for source in every if not source.problem])
        if facts is None:
            manifest = Manifest(found=False, problems=["package.xml could not be read"])
            facts = run([]) or Quality(manifest=manifest)
        return replace(facts, files=_files(facts, every, {source.path for source in unreadable}))


def _raise_if_broken(done: subprocess.CompletedProcess[str] | None) -> None:
    """Raise a GraderError if the linters do not work at all, rather than not on this text."""
    output = done.stdout[-500:] + done.stderr[-500:] if done else ""
    if any(sign in output for sign in ("No module named", "required plugins", "ImportError", "config file does not")):
        words = mark("The linters do not work on this machine: {why}. Run `make setup`.")
        raise GraderError(say(words, why=output.strip()))


def _files(facts: Quality, every: Sequence[PythonFile], too_much: set[str]) -> list[SourceFile]:
    """Return every file, ordered by path, with its lines and the reason why it cannot be read, if so."""
    files = {file.path: file for file in facts.files}
    for source in every:
        known = files.get(source.path)
        problem = source.problem or (known.problem if known else "")
        if not problem and source.path in too_much:
            problem = reading_limits.TOO_HARD
        if known and not problem:
            files[source.path] = replace(known, path=printable(source.path))
        else:
            files[source.path] = SourceFile(printable(source.path), source.rough_lines, problem)
    return [files[path] for path in sorted(files)]


def run_python(arguments: Sequence[str], folder: Path) -> subprocess.CompletedProcess[str] | None:
    """Run our Python with `arguments` in `folder`, isolated. Return None if it exceeded its limits or crashed."""
    limits = [f"--as={_MAX_MEMORY}", f"--cpu={CPU_SECONDS}", "--core=0"]
    command = ["prlimit", *limits, "--", sys.executable, "-I", *arguments]
    # The variable keeps the ROS wheels from starting Python a second time: no ROS is needed here.
    environment = {"PATH": os.environ.get("PATH", ""), "LANG": "C.UTF-8", "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
            errors="replace", check=False, timeout=_WALL_SECONDS,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return None
    except OSError as error:
        raise GraderError(say("Cannot start prlimit ({why}). Install util-linux.", why=error)) from error
    return None if done.returncode < 0 or done.returncode > 128 else done


def run_without_culprits(run: Callable[[Sequence[T]], R | None], items: Sequence[T]) -> tuple[R | None, list[T]]:
    """Return what `run` returns for the items that it can take, and the items that make it fail (return None).

    Usually that is one run over all of them. When it fails, each is tried by itself, for as long as there is time.
    """
    result = run(items)
    if result is not None or not items:
        return result, []
    deadline = time.monotonic() + _SEARCH_SECONDS
    bad = [item for item in items if time.monotonic() > deadline or run([item]) is None]
    good = [item for item in items if item not in bad]
    result = run(good) if bad and good else None
    return (result, bad) if result is not None else (None, list(items))


_TEXT = mark("the package's files")
_HIDDEN_WORDS = 100  # a licence's header may be a comment


class PackageText(Source):
    """Reads the package, with linters where a requirement is about style."""

    name = "quality"
    phase = Phase.TEXT

    def ask(self, subject: Subject) -> Asked:
        """Return the one job of reading it all."""
        # The linters take most of the time, and package.xml needs none.
        submission, settings, left = subject.submission, subject.settings, subject.left
        lint = bool(settings.checked & served(settings, "linters"))
        made = [f"{path}\0{building.content_key([], untrusted.read_text(file) or '')}" for path, file in left.items()]
        job = Job(
            _TEXT, Where.HOST, Quality,
            lambda: analyse_package(submission.package, settings.course, submission.interfaces, left, lint=lint),
            decided_by=(str(lint), subject.handed_in, *sorted(made)), serves=self.serves(settings),
        )  # fmt: skip
        return Asked([job], lambda results: Collected({"quality": results[_TEXT]}, tuple(hidden_flags(results[_TEXT]))))


def hidden_flags(quality: Quality) -> list[Flag]:
    """Return a flag where a README holds much text that no reader sees. It did not count."""
    readme = quality.readme
    if readme is None or readme.hidden < _HIDDEN_WORDS:
        return []
    words = (
        f"{readme.hidden} words are in comments or elements that a reader of the page does not see; they did not count"
    )
    return [Flag("hidden text", words, where=readme.path, concerns=["readme"])]
