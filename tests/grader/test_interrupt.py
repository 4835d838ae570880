"""Ctrl-C at a terminal, in each phase of a grading: one line, at once, and nothing is left."""

from __future__ import annotations

import os
import re
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers import running
from helpers.terminal import Terminal, desk
from submissions.edits import REFERENCE

from grader import KIT

GRADER = "python -P -m grader.cli"
PHASES = (
    "taking in", "building the package", "trial ", "own tests (", "mutating the package", "mutants: ",
    "checking the evidence", "writing the report",
)  # fmt: skip
# The aim is 2 s. More only counts against the grader on a machine that does nothing else.
LIMIT_S = 20.0

pytestmark = [
    pytest.mark.ros,
    pytest.mark.sandbox,
    pytest.mark.slow,  # gradings that are interrupted
    pytest.mark.skipif(shutil.which("bwrap") is None, reason="needs a network of its own: apt-get install bubblewrap"),
]


@pytest.fixture
def temporary(tmp_path: Path) -> Path:
    (tmp_path / "temporary").mkdir()
    return tmp_path / "temporary"


@pytest.fixture
def terminal(tmp_path: Path, temporary: Path) -> Iterator[Terminal]:
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    with desk(tmp_path, os.environ | {"TMPDIR": str(temporary), "PYTHONPATH": str(KIT), "PATH": path}) as open_one:
        yield open_one()


def interrupt(terminal: Terminal, line: str, phase: str) -> str:
    """Run a line, press Ctrl-C when its progress shows a phase, and return the last line of the output."""
    terminal.start(line)
    terminal.wait_for(re.escape(phase), 300.0)
    began = time.monotonic()
    said = terminal.interrupt(LIMIT_S)
    print(f"{line.split()[4]}, {phase.strip(': ')}: {time.monotonic() - began:.2f} s")
    assert "Traceback" not in said
    assert terminal.code == 130
    assert said.endswith("\n")
    return said.splitlines()[-1]


@pytest.mark.parametrize("phase", PHASES)
def test_ctrl_c_ends_a_grading(terminal: Terminal, tmp_path: Path, temporary: Path, phase: str):
    said = interrupt(terminal, f"{GRADER} grade {REFERENCE} --out out", phase)
    assert said == "grader: interrupted; nothing was written."
    assert sorted(path.name for path in tmp_path.iterdir()) == ["temporary"]
    assert list(temporary.iterdir()) == []
    assert running(str(temporary)) == []


def test_ctrl_c_keeps_an_earlier_report(terminal: Terminal, tmp_path: Path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    interrupt(terminal, f"{GRADER} grade {REFERENCE} --out out", "building the package")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["notes.txt"]


def test_ctrl_c_in_a_first_build_leaves_no_half_of_it(terminal: Terminal, tmp_path: Path, temporary: Path):
    interrupt(terminal, f"{GRADER} grade {REFERENCE} --out out --cache cache", "building the contract")
    assert list((tmp_path / "cache" / "builds").glob("*.work*")) == []
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize("phase", ["taking in", "trial "])
def test_ctrl_c_ends_a_check(terminal: Terminal, temporary: Path, phase: str):
    said = interrupt(terminal, f"{GRADER} check F4 F5 --package {REFERENCE}", phase)
    assert said == "grader: interrupted; nothing was written."
    assert list(temporary.iterdir()) == []


def test_ctrl_c_ends_a_batch_and_the_same_command_goes_on(terminal: Terminal, tmp_path: Path, temporary: Path):
    (tmp_path / "in" / "empty").mkdir(parents=True)
    shutil.copytree(REFERENCE, tmp_path / "in" / "team01" / REFERENCE.name)
    said = interrupt(terminal, f"{GRADER} batch in --jobs 1 --out class", "team01 trial ")
    assert said == "grader: interrupted; what is finished is kept. The same command goes on from there. 1 are left."
    assert list(temporary.iterdir()) == []
    assert running(str(temporary)) == []
    assert [path.name for path in (tmp_path / "class" / "submissions").iterdir()] == ["empty"]
    terminal.start(f"{GRADER} batch in --jobs 1 --out class")
    assert "empty" not in terminal.wait_for("1/2; team01")
    terminal.interrupt(LIMIT_S)
