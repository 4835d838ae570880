"""The package's own tests: read (never run) here, run behind a wall, their coverage measured by our configuration."""

from grader.own_tests.read import read_modules
from grader.own_tests.run import run_modules

__all__ = ["read_modules", "run_modules"]
