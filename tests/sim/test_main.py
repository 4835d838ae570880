"""`python -m sim`, and what importing sim needs."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from grader import KIT
from sim import Recording
from sim.__main__ import main, summary


def test_the_summary_of_an_unrepeatable_run_says_why(crash: Recording) -> None:
    unrepeatable = replace(crash, unrepeatable="Not repeatable: <wind> blew.")
    assert summary(unrepeatable).splitlines()[-1] == "Not repeatable: <wind> blew."


def test_the_command_line_drives_and_writes_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run.png"
    assert main(["gate", "--seconds", "3", "--seed", "5", "--profile", "tb4", "--no-noise", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "3.0 s simulated" in said
    assert "seed 5" in said
    assert out.read_bytes().startswith(b"\x89PNG")


def test_an_unknown_world_is_reported_on_stderr_with_exit_code_1(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nowhere"]) == 1
    assert "no world named 'nowhere'" in capsys.readouterr().err


def test_without_a_world_the_worlds_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "office " in capsys.readouterr().out


def test_the_simulator_needs_neither_ros_nor_matplotlib_nor_the_grader() -> None:
    code = "import sim, sys; print([m for m in ('rclpy', 'matplotlib', 'grader', 'rosbags') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], cwd=KIT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
