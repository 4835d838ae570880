"""Run the checks over saved evidence, in a process that has never seen the submission."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from grader import KIT
from grader.course import Course
from grader.errors import GraderError
from grader.evidence import from_json
from grader.host import shortage
from grader.scoring.rubric import Rubric
from grader.scoring.scorecard import CheckResult, Outcome
from grader.words import mark, say

# All checks together take seconds, and 200 MB. What takes much more is a text that was made to.
_CHECK_CPU_S, _LIMIT_S, _MEMORY_BYTES = 30.0, 1200.0, 4 << 30
_FOLDER = Path(__file__).parent
_PYTEST = "import sys; sys.path.insert(0, sys.argv.pop(1)); import pytest; sys.exit(pytest.main(sys.argv[1:]))"
_NEEDS = re.compile(r"^NEEDS = (\(.*\))$", re.MULTILINE)


def known(course: Course) -> list[str]:
    """Return the ids of all checks there are: the course's own, and those that every course can use."""
    return [
        f"{path.stem}::{name}"
        for path in (*course.files("checks", "check_*.py"), *sorted(_FOLDER.glob("check_*.py")))
        for name in _checks_in(path.read_text(encoding="utf-8"))
    ]


@cache
def _checks_in(text: str) -> list[str]:
    functions = (node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef))
    return [function.name for function in functions if function.name.startswith("test_")]


@cache
def needs(course: Course, module: str) -> frozenset[str]:
    """Return the NEEDS of a module of checks: beside trials, the sources of evidence that it reads."""
    found = [words for _, text in _files(course, module) for words in _NEEDS.findall(text)]
    return frozenset(name for words in found for name in ast.literal_eval(words))


def served(course: Course, rubric: Rubric, what: str) -> frozenset[str]:
    """Return the ids of the requirements with a check whose module names `what` among its NEEDS."""
    return frozenset(
        requirement.id
        for requirement in rubric.requirements
        if any(what in needs(course, check.module) for check in requirement.checks)
    )


def _files(course: Course, module: str) -> list[tuple[Path, str]]:
    """Return the files of a module of checks with their texts: the course's own, then that in this folder."""
    paths = (*course.files("checks", f"{module}.py"), *_FOLDER.glob(f"{module}.py"))
    return [(path, path.read_text(encoding="utf-8")) for path in paths]


def _place(course: Course, check: str) -> str:
    """Return where pytest finds a check; the course's own comes first."""
    module, _, function = check.partition("::")
    defines = re.compile(rf"^def {function.partition('[')[0]}\(", re.MULTILINE)
    path = next((path for path, text in _files(course, module) if defines.search(text)), _FOLDER / f"{module}.py")
    return f"{path}::{function}"


def run(course: Course, folder: Path, ids: Sequence[str]) -> list[CheckResult]:
    """Return the results of the checks `ids` ("module::function") over the evidence in `folder`.

    Those that did not end have a result, too.

    Raises:
        GraderError: the checks could not be run at all. A single check that breaks has the outcome error.
    """
    if not ids:
        return []
    with tempfile.TemporaryDirectory() as scratch:
        results = Path(scratch) / "results.json"
        # -I: no user site, no PYTHONPATH, nothing from the working folder; pytest loads no plugin but ours.
        command = [
            sys.executable, "-I", "-c", _PYTEST, str(KIT), "-q", "-c", os.devnull, "--rootdir", str(_FOLDER),
            "-p", "no:cacheprovider", "-p", "grader.checks.pytest_plugin", "--course", str(course.folder),
            "--evidence", str(folder.resolve()), "--results", str(results),
            "--cpu-seconds", str(_CHECK_CPU_S), "--memory", str(_MEMORY_BYTES),
            *(_place(course, check) for check in ids),
        ]  # fmt: skip
        environment = {"PATH": os.environ.get("PATH", ""), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "LANG": "C.UTF-8"}
        environment["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"  # the checks need no ROS
        with subprocess.Popen(
            command, env=environment, cwd=scratch, text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        ) as process:  # fmt: skip
            how = say("did not end within {minutes:g} minutes", minutes=_LIMIT_S / 60)
            try:
                said, _ = process.communicate(timeout=_LIMIT_S)
                how = say("ended the process of the checks with status {status}", status=process.returncode)
            except subprocess.TimeoutExpired:
                process.kill()
                said, _ = process.communicate()
        began = results.exists()
        # Without a line that is not whole: the process was killed.
        lines = results.read_text().rpartition("\n")[0].splitlines() if began else []
        found = [from_json(line, CheckResult) for line in lines]
        missing = [check for check in ids if check not in {result.id for result in found}]
        if missing:
            cause = shortage.explain_output(said) or shortage.explain_disk(Path(scratch))
            if cause or not began:
                words = mark("The checks did not run: {check} {how}:\n{said}")
                raise GraderError(cause or say(words, check=missing[0], how=how, said=said))
        seen = f"{', '.join(missing[:1])} {how}"
        return [*found, *(CheckResult(check, Outcome.ERROR, 0.0, seen=seen) for check in missing)]
