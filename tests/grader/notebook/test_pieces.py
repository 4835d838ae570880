"""`%%into FILE`: a cell's functions go into a file of the package; `tries`: a table of cases on the spot."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from helpers import beside
from helpers.course import PACKAGE

from grader.notebook import cell_hooks, pieces, tables, tries

TEXTS = beside(__file__)

FILE = TEXTS["FILE"]


def test_a_function_takes_the_place_of_the_one_with_its_name():
    piece = "def reach(v):\n    return v * math.pi\n"
    assert pieces.merged(FILE, piece) == FILE.replace(
        '    """Step 1."""\n    return 0.0  # TODO 1\n    # more about TODO 1\n', "    return v * math.pi\n"
    )


def test_a_method_goes_into_its_class_and_comments_around_it_stay():
    speed = "    @property\n    def speed(self):\n        return 1.0\n"
    piece = f"class Driver:\n{speed}\n    def stop(self):\n        return 2\n"
    merged = pieces.merged(FILE, piece)
    assert merged == FILE.replace("        return 0.0\n", "        return 1.0\n").replace(
        '        """Step 2."""\n', "        return 2\n"
    )
    assert "# The end of the way" in merged


def test_a_function_of_ones_own_goes_to_the_end():
    merged = pieces.merged(
        FILE, "def helper():\n    return 1\n\n\nclass Driver:\n    def mine(self):\n        return 2\n"
    )
    assert merged == FILE + "\n    def mine(self):\n        return 2\n\n\ndef helper():\n    return 1\n"
    assert pieces.merged(merged, "def helper():\n    return 3\n") == merged.replace("return 1", "return 3")


@pytest.mark.parametrize(
    ("piece", "words"),
    [
        (
            "def stop(self):\n    return 2\n",
            "`stop` has the argument `self`, so it is a method: put `class ...:` above",
        ),
        ("async def stop(self):\n    return 2\n", "so it is a method"),
        ("def raech(v):\n    return 2\n", "no function `raech`; did you mean `reach`?"),
        ("class Driver:\n    def stopp(self):\n        return 2\n", "did you mean `stop`?"),
        ("import time\n\n\ndef reach(v):\n    return 1\n", "`import time` belongs into the cell that writes the file"),
        ("class Pilot:\n    def stop(self):\n        pass\n", "no class Pilot for stop"),
    ],
    ids=["a forgotten class", "an async method", "a misspelt function", "a misspelt method", "an import", "no class"],
)
def test_a_slip_does_not_add_a_function_beside_the_old_one(piece: str, words: str):
    with pytest.raises(ValueError, match=re.escape(words)):
        pieces.merged(FILE, piece)


def test_a_test_of_ones_own_may_be_called_nearly_like_another():
    text = "def test_ramp_up():\n    assert True\n"
    assert "test_ramp_ups" in pieces.merged(text, "def test_ramp_ups():\n    assert True\n")


def test_a_piece_is_filled_with_the_solution_of_its_functions_only():
    piece = 'def reach(v):\n    """Return it."""\n    return 0.0  # TODO\n'
    assert pieces.filled(piece, "def other():\n    pass\n\n\ndef reach(v):\n    return 2 * v\n") == (
        "def reach(v):\n    return 2 * v"
    )


def test_the_magic_says_what_is_in_the_file_now(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path = tmp_path / "reach.py"
    path.write_text(FILE)
    pieces.into(f" {path} ", "def reach(v):\n    return 7\n\n\ndef helper(v):\n    return v\n")
    assert "return 7" in path.read_text()
    assert capsys.readouterr().out == f"{path} has now: reach, helper (added)\n"


def test_a_piece_before_its_file_and_a_typing_error_write_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path = tmp_path / "reach.py"
    pieces.into(str(path), "def reach(v):\n    return 7\n")
    assert not path.exists()
    assert "Run the cell above that writes it" in capsys.readouterr().out
    path.write_text(FILE)
    pieces.into(str(path), "def reach(v)\n    return 7\n")
    assert path.read_text() == FILE
    assert capsys.readouterr().out == "Nothing was written. Line 2 of this cell: expected ':': def reach(v)\n"


@dataclasses.dataclass
class Command:
    v: float = 0.0


def doubled(x: float) -> float:
    return 2 * x


def test_a_table_says_of_each_call_whether_it_is_right(capsys: pytest.CaptureFixture[str]):
    tries(
        {
            "doubled(0.1)": 0.2,
            "doubled(3)": 7,
            "doubled([])": 0.0,
            "doubled({})": 0.0,
            "Command(doubled(0.15))": Command(0.3),
        }
    )
    assert capsys.readouterr().out == (
        "right    doubled(0.1)            0.2\n"
        "NOT YET  doubled(3)              6, wanted 7\n"
        "NOT YET  doubled([])             [], wanted 0\n"
        "NOT YET  doubled({})             TypeError: unsupported operand type(s) for *: 'int' and 'dict', wanted 0\n"
        "right    Command(doubled(0.15))  Command(v=0.3)\n"
        "2 of 5 right\n"
    )


def test_a_table_reads_the_functions_of_a_file_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "halves.py"
    file.write_text("def halved(x):\n    return x / 2\n")
    tries({"halved(3)": 1.5}, of=str(file))
    file.write_text("import nonsense\ndef halved(x):\n    return x / 2\n")
    tries({"halved(4)": 2.0}, of=str(file))
    file.write_text("def halved(x):\n    return x / 2\nhalved(4)(5)\n")
    tries({"halved(4)": 2.0}, of=str(file))
    assert capsys.readouterr().out.replace(str(tmp_path), "") == (
        "right    halved(3)  1.5\n1 of 1 right\n"
        "halves.py, line 1: No module named 'nonsense'\nright    halved(4)  2\n1 of 1 right\n"
        "NOT YET  /halves.py cannot be run: TypeError: 'float' object is not callable\n"
    )


def test_what_the_notebook_has_imported_is_not_there_for_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """The table was right, and the check, which runs the file, then said that pi is not defined."""
    file = tmp_path / "angles.py"
    file.write_text("def half_turn():\n    return pi\n")
    names = {"__name__": "__main__", "tries": tries, "pi": math.pi}
    exec(f"tries({{'half_turn()': pi}}, of={str(file)!r})", names)
    assert "NOT YET  half_turn()  NameError: name 'pi' is not defined" in capsys.readouterr().out
    file.write_text("from math import pi\ndef half_turn():\n    return pi\n")
    exec(f"tries({{'half_turn()': pi}}, of={str(file)!r})", names)
    assert "1 of 1 right" in capsys.readouterr().out


def test_a_typing_error_in_ones_own_file_is_not_a_cell_that_was_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    """A table names the file by its relative path, and the row said "run the cells above this one first"."""
    monkeypatch.chdir(tmp_path)
    file = Path(PACKAGE, "halves.py")
    file.parent.mkdir()
    file.write_text("def halved(x):\n    return y / 2\n")
    tries({"halved(3)": 1.5, "doubling(3)": 6}, of=str(file))
    own, above, _ = capsys.readouterr().out.splitlines()
    assert own == "NOT YET  halved(3)    NameError: name 'y' is not defined, wanted 1.5"
    assert "run the cells above this one first" in above


@pytest.mark.parametrize(
    ("got", "wanted", "equal"),
    [
        (0.1 + 0.2, 0.3, True),
        (math.nan, math.nan, True),
        (0.0, math.nan, False),
        (1e-9, 0.0, True),
        (1e-5, 0.0, False),
        (math.inf, math.inf, True),
        (1, True, False),
        (None, 0.0, False),
        ([0.1 + 0.2], [0.3], True),
        ([0.3], [0.3, 0.3], False),
        (Command(0.1), Command(0.1 + 1e-12), True),
        (0.1, Command(0.1), False),
    ],
)
def test_values_are_equal_as_a_reader_would_say(got: object, wanted: object, equal: bool):
    assert tables.same(got, wanted) is equal


DRIVER = '''"""A driver."""
import math
from rclpy.node import Node

LIMIT = 0.3


class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        self._near = math.inf

    def stop(self):
        pass
'''


@pytest.mark.parametrize(
    ("cell", "first"),
    [
        ("%%into driver.py\nclass Driver:\n    def stop(self):\n        self._", "self._near"),
        ("%%into driver.py\nclass Driver:\n    def stop(self):\n        return LIM", "LIMIT"),
        ("%%into driver.py\ndef hold():\n    return math.isna", "math.isnan"),
        ("%%writefile new.py\nfrom driver import LI", "LIMIT"),
        ("LIM", ""),
        ("%%writefile config/new.yaml\nLIM", ""),
    ],
)
def test_tab_completes_what_the_file_of_a_cell_defines(cell: str, first: str, tmp_path: Path, monkeypatch):
    """The kernel knows only what was run in it, so `self.` had no name of the learner's own."""
    monkeypatch.chdir(tmp_path)
    Path("driver.py").write_text(DRIVER)
    lines = cell.split("\n")
    asked = SimpleNamespace(
        full_text=f"{cell}\n", cursor_line=len(lines) - 1, cursor_position=len(lines[-1]), token=lines[-1].split()[-1]
    )
    found = [each.text for each in cell_hooks.names_of_the_file(asked)["completions"]]
    assert [text for text in found if "__" not in text][:1] == [first][: bool(first)]
