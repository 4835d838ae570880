"""What a package's text shows: style, docstrings, structure, habits, README, package.xml. Read, never run."""

from grader.quality.read import read

__all__ = ["read"]
