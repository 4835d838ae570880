"""A picture with sliders: `slide` draws it anew while one moves, or while the picture itself is dragged.

Where no kernel runs, it is the first picture.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable
from typing import Any

from sim.views import png

_VIEW = "application/vnd.jupyter.widget-view+json"
# While the kernel draws, the browser keeps only the latest position (save_changes of Jupyter's widgets).
_FOLLOW = """
export default { render({ model, el }) {
  const image = document.createElement("img");
  image.draggable = false; // the browser would drag a copy of the picture
  Object.assign(image.style, { cursor: "grab", touchAction: "none" });
  const show = () => {
    image.alt = model.get("alt");
    URL.revokeObjectURL(image.src);
    image.src = URL.createObjectURL(new Blob([model.get("value")], { type: "image/png" }));
  };
  const follow = (event) => {
    if (!(event.buttons & 1)) return;
    const box = image.getBoundingClientRect();
    model.set("pointer", [(event.clientX - box.left) / box.width, (box.bottom - event.clientY) / box.height]);
    model.save_changes();
  };
  image.onpointerdown = (event) => { image.setPointerCapture(event.pointerId); follow(event); };
  image.onpointermove = follow;
  model.on("change:value", show);
  show();
  el.append(image);
} };
"""


def slide(
    draw: Callable[..., str], *, drag: tuple[str, str] | None = None, **ranges: tuple[float, float, float]
) -> None:
    """Show what `draw(**values)` plots, above a slider for each value; `ranges` holds (lowest, highest, first).

    `draw` makes one matplotlib figure, and returns it in words, for those who do not see it.
    The two values that `drag` names follow the pointer on the figure's first axes, in their units.
    """
    import ipywidgets
    from IPython.display import display

    sliders = {
        name: ipywidgets.FloatSlider(
            value=first, min=low, max=high, step=step(low, high, first), description=name.replace("_", " "),
            style={"description_width": "9em"}, layout={"width": "36em"},
        )
        for name, (low, high, first) in ranges.items()
    }  # fmt: skip
    image = _draggable() if drag else ipywidgets.Image(format="png")
    to_axes: Any = None

    def redraw(_change: object = None) -> str:
        nonlocal to_axes
        image.alt, image.value, to_axes = _drawn(draw, {name: slider.value for name, slider in sliders.items()})
        return str(image.alt)

    def follow(change: Any) -> None:
        for name, value in zip(drag or (), to_axes.transform(change["new"]), strict=True):
            sliders[name].unobserve(redraw, "value")  # one picture for both
            sliders[name].value = value
            sliders[name].observe(redraw, "value")
        redraw()

    for slider in sliders.values():
        slider.observe(redraw, "value")
    words = redraw()
    if drag:
        image.observe(follow, "pointer")
    box = ipywidgets.VBox([image, *sliders.values()])
    bundle = {
        "text/plain": words,
        "image/png": base64.b64encode(image.value).decode(),
        _VIEW: {"version_major": 2, "version_minor": 0, "model_id": box.model_id},
    }
    display(bundle, metadata={"image/png": {"alt": words}}, raw=True)  # type: ignore[no-untyped-call]


def step(low: float, high: float, first: float) -> float:
    """Return a slider's step, about a fiftieth of its range, that leads from `low` to `first` and to `high`.

    Beside its steps a slider would show another value than the one that is drawn.
    """
    about = (high - low) / 50
    for power in (0, -1, -2):
        unit = 10.0 ** (math.floor(math.log10(about)) + power)
        for size in (5 * unit, 2 * unit, unit):
            ways = ((first - low) / size, (high - low) / size)
            if size <= about * (1 + 1e-9) and all(math.isclose(way, round(way), abs_tol=1e-6) for way in ways):
                return size
    return about


def _draggable() -> Any:
    """Return a widget that shows the PNG `value`; `pointer` is where it is dragged to, (0, 0) to (1, 1) upwards."""
    import anywidget
    import traitlets

    class Draggable(anywidget.AnyWidget):
        _esm = _FOLLOW
        alt = traitlets.Unicode().tag(sync=True)
        value = traitlets.Bytes().tag(sync=True)
        pointer = traitlets.List(traitlets.Float()).tag(sync=True)

    return Draggable()


def _drawn(draw: Callable[..., str], values: dict[str, Any]) -> tuple[str, bytes, Any]:
    """Return the picture in words, the picture, and what turns a place in it, (0, 0) to (1, 1), into axes units."""
    import matplotlib.pyplot as plt

    words = draw(**values)
    figure = plt.gcf()
    picture = png(figure, dpi=80)
    to_axes = (figure.transFigure + figure.axes[0].transData.inverted()).frozen()
    plt.close()  # or the front end would show it once more
    return words, picture, to_axes
