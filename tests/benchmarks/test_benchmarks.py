"""Every benchmark runs: each is started in its quick mode, and prints a number for whatever it measures."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

from grader import KIT

RUNS = [
    pytest.param("raycast", ["this caster", "numpy, dense", "pymunk public API, tuned"], id="raycast"),
    pytest.param("realtime", ["0 obstacles", "20 obstacles", "200 obstacles"], id="realtime"),
    pytest.param(
        "lockstep",
        ["smallest node, single-threaded", "smallest node, multi-threaded", "ros2_robot_controller"],
        marks=[pytest.mark.ros, pytest.mark.sandbox], id="lockstep",
    ),
    pytest.param(
        "sandbox_cost",
        ["start and end", "start Python", "import rclpy", "compute", "A grading of the reference on F14"],
        marks=[pytest.mark.ros, pytest.mark.sandbox], id="sandbox_cost",
    ),
]  # fmt: skip


def test_no_benchmark_is_forgotten_here():
    programs = {path.stem for path in (KIT / "benchmarks").glob("*.py") if "--quick" in path.read_text()}
    parts = {"scenes", "smallest_node"}  # which the others use
    assert programs == {path.stem for path in (KIT / "benchmarks").glob("*.py")} - parts
    assert programs == {str(run.values[0]) for run in RUNS}


@pytest.mark.parametrize(("name", "measured"), RUNS)
def test_a_quick_run_measures_everything(name: str, measured: list[str]):
    """`lockstep` once stopped in its rows for the packages, and nothing noticed."""
    ran = subprocess.run(
        [sys.executable, "-m", f"benchmarks.{name}", "--quick"],
        cwd=KIT, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    for what in measured:
        (line,) = re.findall(rf"^[| ]*{re.escape(what)}\b.*$", ran.stdout, re.MULTILINE)[:1]
        assert re.search(r"\d", line.replace(what, "")), line
        assert "nan" not in line
