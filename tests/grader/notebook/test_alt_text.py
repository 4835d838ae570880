"""Figures have an alternative text."""

from __future__ import annotations

from types import SimpleNamespace

import matplotlib.pyplot as plt
import pytest
from IPython.core.formatters import PNGFormatter
from matplotlib.figure import Figure

from grader.notebook.cell_hooks import CellHooks, words_of
from grader.notebook.workspace import Workspace


@pytest.fixture
def figure():
    figure, axes = plt.subplots()
    axes.plot([0, 1], label="by the formula")
    axes.set(title="What is left", xlabel="speed (m/s)", ylabel="clearance (m)")
    yield figure
    plt.close(figure)


def test_a_figure_is_shown_with_its_words(figure: Figure, workspace: Workspace, monkeypatch: pytest.MonkeyPatch):
    shell = SimpleNamespace(display_formatter=SimpleNamespace(formatters={"image/png": PNGFormatter()}))
    png = shell.display_formatter.formatters["image/png"]
    png.for_type(Figure, lambda figure: b"PNG" if figure.patch.get_linewidth() else b"white on a dark page")
    monkeypatch.setattr("IPython.get_ipython", lambda: shell)
    for _ in range(2):
        CellHooks(workspace).draw()
    words = "Plot. What is left: clearance (m) over speed (m/s): by the formula"
    assert png(figure) == (b"PNG", {"alt": words})


def test_the_note_below_a_figure_is_among_its_words(figure: Figure):
    figure.supxlabel("Perhaps not repeatable:\nthe node was busy")
    assert words_of(figure).endswith(": by the formula; Perhaps not repeatable: the node was busy")


def test_a_figure_without_words_is_a_plot():
    assert words_of(Figure()) == "Plot"
