"""Weaknesses of a package's text and tests, so that an attack on what is read or measured has something to gain."""

from __future__ import annotations

import ast
from pathlib import Path

from grader.selftest.package_edits import append, put

_SLOPPY = "".join(f"def Thing{i}( a,b ):\n  import os;x=1\n  l=lambda:a\n  return  a+b\n" for i in range(60))
_A_LITTLE_SLOPPY = _SLOPPY[: _SLOPPY.index("def Thing12(")]
_THINGS = ", ".join(f"sloppy.Thing{i}" for i in range(12))


def _neutralize(package: Path) -> None:
    """Give each assert of the tests another way to hold."""
    for path in (package / "test").glob("test_*.py"):
        lines = path.read_text().splitlines(keepends=True)
        found = [node.test for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Assert)]
        for test in sorted(found, key=lambda node: (node.lineno, node.col_offset), reverse=True):
            for line, column, text in (
                (test.end_lineno, test.end_col_offset, ") or 1 > 0"),
                (test.lineno, test.col_offset, "("),
            ):
                assert line is not None
                old = lines[line - 1].encode()
                lines[line - 1] = (old[:column] + text.encode() + old[column:]).decode()
        path.write_text("".join(lines))


# Nearly no assert can fail: T1 is lost in part, and most of T3.
IDLE_ASSERTS = (_neutralize,)
# Q1 and Q2 are lost.
SLOPPY = (put("ros2_robot_controller/sloppy.py", _SLOPPY),)
# Q1 is lost, and parts of Q2 and Q4: what the nodes use is bad, and the rest of the package clean.
SLOPPY_NODES = (
    put("ros2_robot_controller/sloppy.py", _A_LITTLE_SLOPPY),
    append(
        "ros2_robot_controller/robot_controller.py",
        f"\n\nfrom ros2_robot_controller import sloppy\nTHINGS = list([{_THINGS}])\n",
    ),
)
# Q5 is lost.
NO_WORDS = (put("README.md", "# ros2_robot_controller\n"),)
