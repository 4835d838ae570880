"""Q3: blocks of code that occur twice."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers import beside
from helpers.course import PACKAGE
from helpers.quality_examples import facts, judged, reference

from grader.checks.check_structure import test_no_block_is_repeated as copies
from grader.quality.linting import duplicated_blocks
from grader.quality.parsed_module import parse

TEXTS = beside(__file__)

BLOCK = TEXTS["BLOCK"]


def found(**texts: str) -> list[int]:
    """Return the lengths of the copies in modules of the package, by name."""
    parsed = [parse(f"ros2_robot_controller/{name}.py", text.encode(), PACKAGE) for name, text in texts.items()]
    return [copy.lines for copy in duplicated_blocks(parsed)]


@pytest.mark.parametrize(
    ("texts", "lengths"),
    [
        ({"a": BLOCK, "b": "import math\n\n\n" + BLOCK}, [8]),
        ({"a": BLOCK, "b": TEXTS["RESTYLED"]}, [8]),
        ({"a": BLOCK + "\n\nX = 1\n\n\n" + BLOCK.replace("def measure", "def again")}, [7]),
        ({"a": BLOCK, "b": BLOCK.replace("def measure(scan)", "def nearest(self, scan)")}, [7]),
        ({"a": BLOCK, "b": BLOCK, "c": BLOCK}, [8]),
    ],
    ids=["in two modules", "spaces, comments, line breaks", "in one module", "another name", "in three places"],
)
def test_a_block_that_occurs_again_is_found_once(texts: dict[str, str], lengths: list[int]):
    assert found(**texts) == lengths


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (TEXTS["MAIN"], "every ROS node ends like this"),
        (TEXTS["MESSAGE"], "five statements fill a message"),
        (TEXTS["LAUNCH"], "a launch file's table is one statement"),
        ('"""' + "Words.\n" * 20 + '"""\n', "docstrings are not code"),
        ("import a\nimport b\nimport c\nimport d\nimport e\nimport f\nfrom g import h\n", "imports are not code"),
        ("# one\n# two\n# three\n# four\n# five\n# six\nX = 1\n", "comments are not code"),
    ],
)
def test_some_text_may_be_repeated(text: str, why: str):
    assert found(a=text, b=text) == [], why


def test_tests_may_repeat_themselves():
    parsed = [parse(f"test/test_{name}.py", BLOCK.encode(), PACKAGE) for name in "ab"]
    assert duplicated_blocks(parsed) == []


def test_3000_equal_lines_are_found_in_finite_time():
    assert len(found(a="x.append(1)\n" * 3000)) >= 1


@pytest.mark.parametrize(("end", "share"), [("e * 7", 0.75), ("e", 1.0)])
def test_six_lines_are_the_shortest_copy(tmp_path: Path, end: str, share: float):
    block = "    a = x + 1\n    b = a * 2\n    c = b - x\n    d = c / 3\n    e = d + a\n"
    text = f"def one(x):\n{block}    return e * 7\n\n\ndef two(x):\n{block}    return {end}\n"
    found = facts(reference(tmp_path, files={"ros2_robot_controller/utils/more.py": text}))
    assert judged(copies, found).share == share
