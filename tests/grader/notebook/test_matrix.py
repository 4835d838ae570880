"""`mutant_matrix`: which mutants of a module are noticed by which tests, without a robot and without a sandbox."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from grader.notebook import mutant, mutant_matrix
from grader.notebook.matrix import matrix
from grader.notebook.tables import MissingError

STOPPING = """\
def is_near(distance):
    return distance < 0.5


def speed(distance):
    return 0.0 if is_near(distance) else 0.4
"""


@pytest.fixture
def noticed(tmp_path: Path):
    """Return a function from the text of tests to the mutants of is_near that each notices."""

    def by(tests: str, module: str = STOPPING, function: str = "is_near") -> dict[str, set[str]]:
        (tmp_path / "stopping.py").write_text(module)
        (tmp_path / "test_stopping.py").write_text(tests)
        found = matrix(tmp_path / "stopping.py", tmp_path / "test_stopping.py", function)
        rows = list(zip(found.mutants, found.noticed, strict=True))
        return {test: {words for words, row in rows if row[i]} for i, test in enumerate(found.tests)}

    return by


LESS, HALF = "2: < became >= in distance < 0.5", "2: 0.5 became 1.0"


@pytest.mark.parametrize(
    ("tests", "by"),
    [
        (
            "from stopping import is_near\n"
            "def test_wall():\n    assert is_near(0.3)\n"
            "def test_edge():\n    assert not is_near(0.5)\n"
            "def test_nothing():\n    assert is_near(0.3) is not None\n",
            {"wall": {LESS}, "edge": {LESS, HALF}, "nothing": set()},
        ),
        (
            "import pytest\nfrom stopping import is_near\n"
            "@pytest.mark.parametrize(('distance', 'near'), [(0.3, True), (0.7, False)])\n"
            "def test_table(distance, near):\n    assert is_near(distance) is near\n",
            {"table": {LESS, HALF}},
        ),
        ("def test_wall():\n    from stopping import is_near\n    assert is_near(0.3)\n", {"wall": {LESS}}),
        ("def test_node(make_bench):\n    assert 0\n", {}),
    ],
    ids=["each test by itself", "each row of a table", "an import in the test", "a fixture"],
)
def test_a_mutant_is_noticed_by_the_test_that_fails_on_it(noticed, tests, by):
    assert noticed(tests) == by
    assert "stopping" not in sys.modules, "the real module is the one that is imported afterwards"


def test_a_mutant_that_never_ends_is_noticed(noticed, monkeypatch):
    monkeypatch.setattr("grader.notebook.matrix.LONGEST_S", 0.2)
    counting = "def count(n):\n    while n > 0:\n        n = n - 1\n    return n\n"
    tests = "from stopping import count\ndef test_ends():\n    assert count(3) == 0\n"
    assert "3: - became + in n - 1" in noticed(tests, counting, "count")["ends"]


@pytest.mark.parametrize(
    ("tests", "said"),
    [
        (
            "import pytest\ndef test_later():\n    pytest.fail('not written yet')\n",
            "test_later(): Failed: not written yet",
        ),
        (
            "import pytest\nfrom stopping import is_near\n"
            "@pytest.mark.parametrize(('distance', 'near'), [(0.3, True), (0.7, True)])\n"
            "def test_table(distance, near):\n    assert is_near(distance) is near\n",
            "test_table(distance=0.7, near=True): AssertionError",
        ),
    ],
)
def test_a_test_that_fails_anyway_is_named_with_its_row_and_left_out(tests, said, tmp_path, capsys):
    (tmp_path / "stopping.py").write_text(STOPPING)
    (tmp_path / "test_stopping.py").write_text(tests)
    mutant_matrix(str(tmp_path / "stopping.py"), str(tmp_path / "test_stopping.py"))
    assert capsys.readouterr().out.endswith(f" fails on the code as it is, so it is left out: {said}\n")


def test_a_mutant_can_be_called_and_says_its_mistake(tmp_path, capsys):
    (tmp_path / "stopping.py").write_text(STOPPING)
    broken = mutant(str(tmp_path / "stopping.py"), 1, "is_near")
    assert capsys.readouterr().out == "2: < became >= in distance < 0.5\n"
    assert (broken.speed(0.3), broken.speed(0.7)) == (0.4, 0.0)
    assert "stopping" not in sys.modules


@pytest.mark.parametrize(
    ("row", "module", "words"),
    [(0, STOPPING, "no row 0"), (3, STOPPING, "no row 3"), (1, "def f(:\n", "SyntaxError"), (1, None, "FileNotFound")],
)
def test_a_row_that_is_not_there_is_said_once_and_again_with_each_use(row, module, words, tmp_path, capsys):
    if module is not None:
        (tmp_path / "stopping.py").write_text(module)
    broken = mutant(str(tmp_path / "stopping.py"), row, "is_near")
    assert words in capsys.readouterr().out
    with pytest.raises(MissingError, match=words):
        broken.speed(0.3)


@pytest.mark.parametrize(
    ("module", "tests", "words"),
    [
        (None, "", "not yet: FileNotFoundError"),
        ("def f(:\n", "", "not yet: SyntaxError"),
        (STOPPING, "import nothing_of_this_name\n", "not yet: ModuleNotFoundError"),
        (STOPPING, "\n", "holds no test"),
    ],
)
def test_what_is_missing_is_said_without_a_traceback(module, tests, words, tmp_path, capsys):
    if module is not None:
        (tmp_path / "stopping.py").write_text(module)
    (tmp_path / "test_stopping.py").write_text(tests)
    mutant_matrix(str(tmp_path / "stopping.py"), str(tmp_path / "test_stopping.py"))
    assert words in capsys.readouterr().out
