"""In the probe every function of a package raises, and its modules can be imported all the same."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from helpers import beside

from grader.student_tests.probe import function_lines, raising

TEXTS = beside(__file__)


@pytest.fixture
def probed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "probed_limits.py").write_text(raising(TEXTS["MODULE"]))
    (tmp_path / "probed_user.py").write_text(raising("from probed_limits import twice\nFOUR = twice(2)\n"))
    monkeypatch.syspath_prepend(tmp_path)
    import probed_limits
    import probed_user

    yield probed_limits, probed_user
    for name in ("probed_limits", "probed_user"):
        del sys.modules[name]


def test_what_modules_call_while_they_are_imported_works(probed):
    limits, user = probed
    assert (limits.TOP, limits.Robot.LIMIT, limits.ROBOT.speed, user.FOUR) == (0.5, 1.0, 0.0, 4)


@pytest.mark.parametrize(
    "call",
    [
        lambda limits: limits.twice(1),
        lambda limits: limits.Robot(),
        lambda limits: limits.ROBOT.fast,
        lambda limits: limits.ROBOT.wait().send(None),
        lambda limits: limits.drive(),
    ],
)
def test_each_function_raises_as_soon_as_it_is_called(probed, call):
    with pytest.raises(Exception, match="every function of the package raises in this run"):
        call(probed[0])


@pytest.mark.parametrize("text", ["def (:\n", "x = " + "+".join(["1"] * 5000), ""])
def test_what_python_cannot_take_apart_stays_as_it_is(text: str):
    assert raising(text) == text or not text


def test_docstrings_and_heads_are_no_lines_of_a_function():
    text = 'def f(a,\n      b):\n    """Say."""\n    c = a\n    return c\n\n\ndef g(): return 1\nX = f(1, 2)\n'
    assert function_lines(text) == {4, 5}
