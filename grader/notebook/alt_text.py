"""Give each matplotlib figure of a notebook a frame, and an alternative text for those who do not see it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from grader.words import say


def describe_figures(shell: Any) -> None:
    """Let figures be shown framed and with their words from now on. Called after each cell, before they are shown."""
    if "matplotlib.figure" not in sys.modules:
        return
    from matplotlib.figure import Figure

    formatter = shell.display_formatter.formatters["image/png"]
    drawn = formatter.type_printers.get(Figure)
    if drawn is None or isinstance(drawn, _Described):
        return
    formatter.for_type(Figure, _Described(drawn))


class _Described:
    """A function from a figure to its picture and the picture's metadata."""

    def __init__(self, draw: Callable[[Any], Any]) -> None:
        self._draw = draw

    def __call__(self, figure: Any) -> Any:
        from sim.views import framed

        drawn = self._draw(framed(figure))
        return drawn if isinstance(drawn, tuple) else (drawn, {"alt": words_of(figure)})


def words_of(figure: Any) -> str:
    """Return what a figure says of itself: titles, what is drawn over what, names in legends, the note below."""
    parts = [figure.get_suptitle()]
    for axes in figure.axes:
        over = say(" over ").join(filter(None, (axes.get_ylabel(), axes.get_xlabel())))
        names = ", ".join(axes.get_legend_handles_labels()[1])
        parts.append(": ".join(filter(None, (axes.get_title(), over, names))))
    parts.append(figure.get_supxlabel().replace("\n", " "))
    return f"Plot. {'; '.join(filter(None, parts))}".removesuffix(". ")
