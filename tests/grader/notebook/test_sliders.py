"""`slide`: a picture that is drawn anew while a slider moves."""

from __future__ import annotations

from typing import Any

import IPython.display
import ipywidgets
import matplotlib.pyplot as plt
import pytest

from grader.notebook.sliders import slide


def test_a_slider_that_moves_draws_the_picture_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[dict[str, Any]] = []
    boxes: list[ipywidgets.VBox] = []
    make = ipywidgets.VBox
    monkeypatch.setattr(IPython.display, "display", lambda bundle, **_: shown.append(bundle))
    monkeypatch.setattr(ipywidgets, "VBox", lambda children: boxes.append(make(children)) or boxes[-1])

    def draw(gain: float, delay: float) -> str:
        plt.figure(figsize=(2, 1))
        plt.plot([0, gain], [0, delay])
        return f"gain {gain:g}, delay {delay:g}"

    slide(draw, gain=(0.0, 10.0, 1.5), delay=(0.0, 0.5, 0.1))
    assert shown[0]["text/plain"] == "gain 1.5, delay 0.1"
    assert shown[0]["image/png"].startswith("iVBOR")
    image, gain, _ = boxes[0].children
    before = image.value
    gain.value = 9.0
    assert image.value != before
    assert plt.get_fignums() == [], "the front end would show a figure that is left open"
