"""The benchmark runs."""

from __future__ import annotations

import subprocess
import sys

import pytest

from grader import KIT


@pytest.mark.ros
@pytest.mark.sandbox
def test_the_benchmark_of_the_packages_tests_runs():
    command = [sys.executable, "-m", "benchmarks.package_tests", "--quick"]
    ran = subprocess.run(command, cwd=KIT, capture_output=True, text=True, check=True)
    assert "| results and coverage (T1, T2) |" in ran.stdout
    assert "40 of 40 mutants were tried" in ran.stdout
