"""The package's own tests: read (never run) here, run behind a wall, their coverage measured by our configuration."""

from grader.student_tests.discover import read_modules
from grader.student_tests.suite_run import MODULE_SECONDS, OwnRun, Reach, run_modules

__all__ = ["MODULE_SECONDS", "OwnRun", "Reach", "read_modules", "run_modules"]
