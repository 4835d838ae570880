"""Run the checks over saved evidence, in a process that has never seen the submission."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from grader.errors import GraderError
from grader.host import shortage
from grader.scoring.scorecard import CheckResult, Outcome

_LIMIT_S = 300.0  # the checks take seconds
_FOLDER = Path(__file__).parent


def known() -> list[str]:
    """Return the ids of all checks there are."""
    return [
        f"{path.stem}::{node.name}"
        for path in sorted(_FOLDER.glob("check_*.py"))
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    ]


def run(folder: Path, ids: Sequence[str]) -> list[CheckResult]:
    """Return the results of the checks `ids` ("module::function") over the evidence in `folder`.

    Raises:
        GraderError: the checks could not be run at all. A single check that breaks has the outcome error.
    """
    if not ids:
        return []
    with tempfile.TemporaryDirectory() as scratch:
        results = Path(scratch) / "results.json"
        # -I: no user site, no PYTHONPATH, nothing from the working folder; pytest loads no plugin but our conftest.
        command = [
            sys.executable, "-I", "-m", "pytest", "-q", "-c", os.devnull, "--rootdir", str(_FOLDER),
            "-p", "no:cacheprovider", "--evidence", str(folder.resolve()), "--results", str(results),
            *(str(_FOLDER / f"{check.replace('::', '.py::', 1)}") for check in ids),
        ]  # fmt: skip
        environment = {"PATH": os.environ.get("PATH", ""), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "LANG": "C.UTF-8"}
        environment["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"  # the checks need no ROS
        try:
            done = subprocess.run(
                command, env=environment, cwd=scratch, capture_output=True, text=True, check=False, timeout=_LIMIT_S
            )
        except subprocess.TimeoutExpired as error:
            raise GraderError(
                f"The checks did not end within {_LIMIT_S:g} s; they usually take seconds. Grade again on a less busy "
                "machine; if they do not end there either, it is an error of the grader."
            ) from error
        if not results.exists():
            said = done.stdout + done.stderr
            raise GraderError(
                shortage.explain_output(said)
                or shortage.explain_disk(Path(scratch))
                or f"The checks did not run (status {done.returncode}):\n{said}"
            )
        return [_result(entry) for entry in json.loads(results.read_text())]


def _result(entry: dict[str, object]) -> CheckResult:
    return CheckResult(**{**entry, "outcome": Outcome(entry["outcome"])})  # type: ignore[arg-type]
