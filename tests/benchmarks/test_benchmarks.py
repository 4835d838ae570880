"""Every benchmark runs: each is started in its quick mode, and prints a number for whatever it measures."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys

import pytest

from grader import KIT

SLOW = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # nodes and tests that run, in sandboxes
RUNS = [
    pytest.param("raycast", ["this caster", "numpy, dense", "pymunk public API, tuned"], id="raycast"),
    pytest.param("realtime", ["0 obstacles", "20 obstacles", "200 obstacles"], id="realtime"),
    pytest.param(
        "lockstep",
        ["smallest node, single-threaded", "smallest node, multi-threaded", "ros2_robot_controller"],
        marks=SLOW, id="lockstep",
    ),
    pytest.param(
        "sandbox_cost",
        ["start and end", "start Python", "import rclpy", "compute", "A grading of the reference on F14"],
        marks=SLOW, id="sandbox_cost",
    ),
    pytest.param("check", ["Q1"], marks=SLOW, id="check"),
    pytest.param("hunting", ["| 2 |", "| 1 |"], marks=SLOW, id="hunting"),
    pytest.param("grading", ["I2"], marks=SLOW, id="grading"),
    pytest.param(
        "package_tests",
        ["results and coverage (T1, T2)", "mutants (T3)", "40 of 40 mutants were tried"],
        marks=SLOW, id="package_tests",
    ),
]  # fmt: skip


def test_no_benchmark_is_forgotten_here():
    programs = {path.stem for path in (KIT / "benchmarks").glob("*.py") if "--quick" in path.read_text()}
    parts = {"scenes", "smallest_node"}  # which the others use
    assert programs == {path.stem for path in (KIT / "benchmarks").glob("*.py")} - parts
    assert programs == {str(run.values[0]) for run in RUNS}


@pytest.mark.parametrize("name", [run.values[0] for run in RUNS])
def test_a_benchmark_finds_what_it_imports(name: str):
    """Those of nodes and tests run every night."""
    importlib.import_module(f"benchmarks.{name}")


@pytest.mark.parametrize(("name", "measured"), RUNS)
def test_a_quick_run_measures_everything(name: str, measured: list[str]):
    """One that had stopped in the middle of its table was noticed by nothing."""
    ran = subprocess.run(
        [sys.executable, "-m", f"benchmarks.{name}", "--quick"],
        cwd=KIT, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    for what in measured:
        line = next((line for line in ran.stdout.splitlines() if what in line), "no such line")
        assert re.search(r"\d", line.replace(what, "")), f"{what}: {line}"
        assert "nan" not in line
