"""The tests in several processes: what stays together, and what begins first."""

from __future__ import annotations

import ast
import itertools

import pytest
from helpers import sharing

from grader import KIT


def test_a_file_stays_in_one_process():
    assert sharing.scope("tests/a.py::test_x[1::2]") == sharing.scope("tests/a.py::TestIt::test_y") == "tests/a.py"


def test_files_whose_nodes_share_this_machines_network_stay_in_one_process():
    assert {sharing.scope(f"{file}::test_x") for file in sharing.ONE_NETWORK} == {"one network"}


def test_every_file_that_starts_rclpy_itself_is_among_them():
    """Two domains chosen by chance meet one day, and then a test hears another's nodes."""
    trees = {
        path: ast.parse(path.read_text()) for path in (KIT / "tests").rglob("test_*.py") if "solution" not in path.parts
    }
    found = {
        path.relative_to(KIT).as_posix()
        for path, tree in trees.items()
        for node in tree.body
        if isinstance(node, ast.Import) and node.names[0].name == "rclpy"
    }
    assert found - set(sharing.ONE_NETWORK) == set()


@pytest.mark.parametrize("file", sharing.DEAR)
def test_the_files_that_begin_first_exist(file: str):
    assert (KIT / file).is_file()


def test_the_dear_files_begin_first():
    names = ["tests/sim/test_lidar.py::test_x", f"{sharing.DEAR[1]}::test_y", f"{sharing.DEAR[0]}::test_z"]
    assert sorted(names, key=sharing.rank) == names[::-1]


def test_every_slow_test_says_why_it_is_slow():
    marks = {
        f"{path.relative_to(KIT)}:{number}": f"{above} {line}"
        for path in (KIT / "tests").rglob("*.py")
        if path.name not in ("test_sharing.py", "test_source.py")
        for number, (above, line) in enumerate(itertools.pairwise(path.read_text().splitlines()), 2)
        if "mark.slow" in line
    }
    assert len(marks) > 40
    assert {where for where, lines in marks.items() if "# " not in lines} == set()
