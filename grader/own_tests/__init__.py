"""The package's own tests: read (never run) here, run behind a wall, their coverage measured by our configuration."""

from grader.own_tests.read import read_modules
from grader.own_tests.run import OwnRun, Reach, run_modules

__all__ = ["OwnRun", "Reach", "read_modules", "run_modules"]
