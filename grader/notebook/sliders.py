"""A picture with sliders: `slide` draws it anew while one moves. Where no kernel runs, it is the first picture."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import Any

_VIEW = "application/vnd.jupyter.widget-view+json"


def slide(draw: Callable[..., str], **ranges: tuple[float, float, float]) -> None:
    """Show what `draw(**values)` plots, above a slider for each value; `ranges` holds (lowest, highest, first).

    `draw` makes one matplotlib figure, and returns it in words, for those who do not see it.
    """
    import ipywidgets
    from IPython.display import display

    sliders = {
        name: ipywidgets.FloatSlider(
            value=first, min=low, max=high, step=(high - low) / 50, description=name.replace("_", " "),
            style={"description_width": "9em"}, layout={"width": "36em"},
        )
        for name, (low, high, first) in ranges.items()
    }  # fmt: skip
    image = ipywidgets.Image(format="png")

    def redraw(_change: object = None) -> str:
        image.value, words = _drawn(draw, {name: slider.value for name, slider in sliders.items()})
        return words

    for slider in sliders.values():
        slider.observe(redraw, "value")
    words = redraw()
    box = ipywidgets.VBox([image, *sliders.values()])
    bundle = {
        "text/plain": words,
        "image/png": base64.b64encode(image.value).decode(),
        _VIEW: {"version_major": 2, "version_minor": 0, "model_id": box.model_id},
    }
    display(bundle, metadata={"image/png": {"alt": words}}, raw=True)  # type: ignore[no-untyped-call]


def _drawn(draw: Callable[..., str], values: dict[str, Any]) -> tuple[bytes, str]:
    import matplotlib.pyplot as plt

    words = draw(**values)
    stream = io.BytesIO()
    plt.gcf().savefig(stream, format="png", dpi=80)
    plt.close()  # or the front end would show it once more
    return stream.getvalue(), words
