"""The picture at the head of notebook 09: the same code and three sets of tests; green is a mutant that was noticed."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from grader.course import kits_own
from grader.mutation.operators import mutants
from grader.mutation.source_text import Change, SourceText, parse
from sim.views import View

Code = SimpleNamespace
Test = Callable[[Code], None]

# The code of the notebook's first cell, word for word.
CODE = """\
import math


def closest(ranges):
    return min([r for r in ranges if 0.15 <= r <= 12.0], default=math.inf)


def safe_speed(wanted, ranges):
    if closest(ranges) < 0.5:
        return 0.0
    if closest(ranges) < 0.8 and wanted > 0.2:
        return 0.2
    return wanted
"""


def reaches_all(code: Code) -> None:
    """Reach every line and branch, and look at nothing."""
    for ranges in ([], [0.3], [0.7], [5.0]):
        assert code.safe_speed(0.4, ranges) is not None


def stops(code: Code) -> None:
    """Stand still at a wall."""
    assert code.safe_speed(0.4, [0.3]) == 0.0


def slows_down(code: Code) -> None:
    """Drive slowly near a wall."""
    assert code.safe_speed(0.4, [0.6]) == 0.2


def drives_on(code: Code) -> None:
    """Drive where the way is free."""
    assert code.safe_speed(0.4, [1.5]) == 0.4
    assert code.safe_speed(0.4, []) == 0.4


def knows_edges(code: Code) -> None:
    """Belong to the right side of each edge."""
    assert code.safe_speed(0.4, [0.5]) == 0.2
    assert code.safe_speed(0.4, [0.8]) == 0.4
    assert code.safe_speed(0.3, [0.6]) == 0.2
    assert code.safe_speed(0.1, [0.6]) == 0.1
    assert code.safe_speed(0.4, [5.0, 0.15]) == 0.0


def knows_far(code: Code) -> None:
    """Take no reading beyond the range for one."""
    assert code.closest([20.0]) == float("inf")


SUITES: Sequence[tuple[str, Sequence[Test]]] = (
    ("all lines\nreached", (reaches_all,)),
    ("the obvious\nasserted", (reaches_all, stops, slows_down, drives_on)),
    ("and the\nedges", (reaches_all, stops, slows_down, drives_on, knows_edges, knows_far)),
)


def draw() -> Figure:
    """Return a table of mutants and tests for each set of tests."""
    source = parse("stopping.py", CODE)
    assert source is not None
    every = mutants(source, kits_own())
    figure = View(figsize=(13.0, 4.8), layout="constrained")
    figure.suptitle("The same code, three sets of tests: how many of its mutants are noticed (green)", fontsize=11)
    tables = figure.subplots(1, 3, sharey=True, width_ratios=[1, 4, 6])
    for axes, (title, tests) in zip(tables, SUITES, strict=True):
        _draw_table(axes, title, source, every, tests)
    words = [f"line {mutant.line}: {mutant.words.replace('`', '')}" for mutant in every]
    tables[0].set_yticks(np.arange(len(every)) + 0.5, words[::-1], fontsize=7)
    return figure


def _draw_table(axes: Axes, title: str, source: SourceText, every: Sequence[Change], tests: Sequence[Test]) -> None:
    seen = np.array([[_notices(test, source, mutant) for test in tests] for mutant in every])
    colours = ListedColormap(["0.9", "#3a9d6a"])
    axes.pcolormesh(seen[::-1], cmap=colours, vmin=0, vmax=1, edgecolors="white", linewidth=2)
    axes.set_xticks(np.arange(len(tests)) + 0.5, [test.__name__.replace("_", "\n") for test in tests], fontsize=8)
    axes.set_title(f"{title}:\n{seen.any(axis=1).sum()} of {len(seen)}", fontsize=9)


def _notices(test: Test, source: SourceText, mutant: Change) -> bool:
    broken: dict[str, object] = {}
    exec(source.apply(mutant), broken)  # our own text with a small change
    try:
        test(SimpleNamespace(**broken))
    except Exception:
        return True
    return False
