"""The process that runs the checks, and its limits: a text that takes hours to read costs a check, not the grading."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from helpers import until
from helpers.course import COURSE
from helpers.judging import evidence_with

from grader import evidence
from grader.checks import checks_run
from grader.checks.judge import Judge, Unjudged
from grader.errors import GraderError
from grader.scoring.scorecard import CheckResult, Outcome
from grader.trials.plan import TrialPlan
from grader.trials.request import not_started

CHECKS = {
    "first": "pass",
    "slow_words": "re.search('(a+)+$', 'a' * 60 + 'b')",
    "slow_code": "while True: pass",
    "much": "bytearray(1 << 40)",
    "hangs": "time.sleep(1000)",
    "crashes": "ctypes.string_at(0)",
    "last": "pass",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of some evidence, over which these checks can be run."""
    checks = tmp_path / "checks"
    checks.mkdir()
    functions = [f"def test_{name}(judge):\n    {body}\n" for name, body in CHECKS.items()]
    (checks / "check_it.py").write_text("\n".join(["import ctypes, re, time", *functions]))
    monkeypatch.setattr(checks_run, "_FOLDER", checks)
    monkeypatch.setattr(checks_run, "_CHECK_CPU_S", 0.2)
    evidence.save(evidence_with(), tmp_path / "evidence")
    return tmp_path / "evidence"


def run(folder: Path, *names: str) -> dict[str, CheckResult]:
    results = checks_run.run(COURSE, folder, [f"check_it::test_{name}" for name in names])
    assert len(results) == len(names)
    return {result.id.partition("_it::test_")[2]: result for result in results}


@pytest.mark.slow  # waits for a limit; so does the one that never ends
@pytest.mark.parametrize("name", ["slow_words", "slow_code"])
def test_a_check_that_computes_for_ever_is_an_error_and_the_others_are_judged(folder: Path, name: str):
    found = run(folder, "first", name, "last")
    assert found[name].outcome is Outcome.ERROR
    seen = r"TookTooLong: the check took more than 0.2 s of CPU time \(check_it.py, line \d+\)"
    assert re.fullmatch(seen, found[name].seen)  # the line of the check, as of any error in one
    assert found["first"].outcome is found["last"].outcome is Outcome.PASSED


def test_a_check_that_wants_too_much_memory_is_an_error(folder: Path):
    found = run(folder, "much", "last")
    assert (found["much"].outcome, found["much"].seen) == (Outcome.ERROR, "MemoryError:  (check_it.py, line 12)")
    assert found["last"].outcome is Outcome.PASSED


def test_a_script_that_breaks_is_named_with_its_line():
    """A lecturer read "the trial box broke: KeyError: 'x'", and not where."""
    frames = (
        '  File "/home/lee/mine/trials/b5.py", line 19, in box\n  File "/kit/grader/trials/stage.py", line 90, in run\n'
    )
    broke = not_started(TrialPlan("box", "", print, "guard"), 0, f"Traceback:\n{frames}KeyError: 'x'\n")
    judge = Judge(evidence_with(trials={"box": broke}), COURSE)
    with pytest.raises(Unjudged, match=r"the trial box broke: KeyError: 'x' \(trials/b5.py, line 19\)"):
        judge.trial("box")


def test_a_check_that_ends_the_process_is_named_and_what_was_judged_before_counts(folder: Path):
    assert run(folder, "crashes")["crashes"].outcome is Outcome.ERROR
    found = run(folder, "first", "crashes", "last")
    assert found["first"].outcome is Outcome.PASSED
    assert found["crashes"].outcome is found["last"].outcome is Outcome.ERROR
    words = "check_it::test_crashes ended the process of the checks with status -11"
    assert found["crashes"].seen == found["last"].seen == words


def test_a_check_that_never_ends_is_named_and_what_was_judged_before_counts(
    folder: Path, monkeypatch: pytest.MonkeyPatch
):
    class Impatient(subprocess.Popen[str]):
        """Its time is up as soon as the first result is there."""

        def communicate(self, input: str | None = None, timeout: float | None = None) -> tuple[str, str]:
            assert isinstance(self.args, list)
            results = Path(self.args[self.args.index("--results") + 1])
            until(lambda: timeout is None or (results.exists() and results.read_text().endswith("\n")))
            return super().communicate(input, timeout)

    monkeypatch.setattr(subprocess, "Popen", Impatient)
    monkeypatch.setattr(checks_run, "_LIMIT_S", 0.0)
    first, hangs = checks_run.run(COURSE, folder, ["check_it::test_first", "check_it::test_hangs"])
    assert first.outcome is Outcome.PASSED
    assert (hangs.outcome, hangs.seen) == (Outcome.ERROR, "check_it::test_hangs did not end within 0 minutes")


def test_checks_that_do_not_begin_are_an_error_of_the_grader(folder: Path):
    (folder / "build.json").write_text("{")
    with pytest.raises(GraderError, match="The checks did not run: check_it::test_first"):
        run(folder, "first")
