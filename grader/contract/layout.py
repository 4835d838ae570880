"""What a file of a package is there for, by its place in the contract's layout."""

from __future__ import annotations

from pathlib import PurePosixPath

from grader.contract.spec import PACKAGE

JUDGED = ("module", "launch", "script")
"""The roles of what a robot runs; tests and setup.py serve the author."""


def role(path: str) -> str:
    """Return what a file is there for, by its place in the package.

    What lies in the Python package can be imported by the nodes, so its name makes it neither test nor launch file.
    """
    parts = PurePosixPath(path).parts
    name = parts[-1]
    if parts[0] == PACKAGE and len(parts) > 1:
        return "module"
    if parts[0] in ("test", "tests") or (len(parts) == 1 and _is_pytests(name)):
        return "test"
    if parts == ("setup.py",):
        return "setup"
    if parts[0] == "launch" or name.endswith((".launch.py", "_launch.py")):
        return "launch"
    # What is no `.py` file is here for its first line, which makes it a program.
    in_scripts = parts[0] in ("scripts", "bin", "examples", "tools", "demo")
    return "script" if in_scripts or not name.endswith(".py") else "module"


def _is_pytests(name: str) -> bool:
    return name == "conftest.py" or (name.startswith("test_") and name.endswith(".py")) or name.endswith("_test.py")
