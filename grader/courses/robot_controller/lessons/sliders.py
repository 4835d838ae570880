"""A picture with sliders: `slide` draws it anew while one moves. Where no kernel runs, it is the first picture."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable

from sim.views import png

_VIEW = "application/vnd.jupyter.widget-view+json"


def slide(draw: Callable[..., str], **ranges: tuple[float, float, float]) -> None:
    """Show what `draw(**values)` plots, above a slider for each value; `ranges` holds (lowest, highest, first).

    `draw` makes one matplotlib figure, and returns it in words, for those who do not see it.
    """
    import ipywidgets
    import matplotlib.pyplot as plt
    from IPython.display import display

    sliders = {
        name: ipywidgets.FloatSlider(
            value=first, min=low, max=high, step=step(low, high, first), description=name.replace("_", " "),
            style={"description_width": "9em"}, layout={"width": "36em"},
        )
        for name, (low, high, first) in ranges.items()
    }  # fmt: skip
    image = ipywidgets.Image(format="png")

    def redraw(_change: object = None) -> str:
        image.alt = draw(**{name: slider.value for name, slider in sliders.items()})
        image.value = png(plt.gcf(), dpi=80)
        plt.close()  # or the front end would show it once more
        return str(image.alt)

    for slider in sliders.values():
        slider.observe(redraw, "value")
    words = redraw()
    box = ipywidgets.VBox([image, *sliders.values()])
    bundle = {
        "text/plain": words,
        "image/png": base64.b64encode(image.value).decode(),
        _VIEW: {"version_major": 2, "version_minor": 0, "model_id": box.model_id},
    }
    display(bundle, metadata={"image/png": {"alt": words}}, raw=True)


def step(low: float, high: float, first: float) -> float:
    """Return a slider's step, about a fiftieth of its range, that leads from `low` to `first` and to `high`.

    Beside its steps a slider would show another value than the one that is drawn.
    """
    about = (high - low) / 50
    decade = math.floor(math.log10(about))
    for size in (digit * 10.0**power for power in (decade, decade - 1, decade - 2) for digit in (5, 2, 1)):
        ways = ((first - low) / size, (high - low) / size)
        if size <= about * (1 + 1e-9) and all(math.isclose(way, round(way), abs_tol=1e-6) for way in ways):
            return size
    return about
