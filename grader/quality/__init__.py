"""What a package's text shows: style, docstrings, structure, habits, README, package.xml. Read, never run."""

from grader.quality.analyse import analyse_package

__all__ = ["analyse_package"]
