"""`slide`: a picture that is drawn anew while a slider moves."""

from __future__ import annotations

import re
from typing import Any

import IPython.display
import ipywidgets
import matplotlib.pyplot as plt
import pytest

from grader import KIT
from grader.courses.robot_controller.lessons.sliders import slide, step


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Return a list that gets what is displayed."""
    bundles: list[dict[str, Any]] = []
    monkeypatch.setattr(IPython.display, "display", lambda bundle, **_: bundles.append(bundle))
    return bundles


@pytest.fixture
def boxes(monkeypatch: pytest.MonkeyPatch) -> list[ipywidgets.VBox]:
    """Return a list that gets the picture and sliders of each `slide`."""
    made: list[ipywidgets.VBox] = []
    make = ipywidgets.VBox
    monkeypatch.setattr(ipywidgets, "VBox", lambda children: made.append(make(children)) or made[-1])
    return made


def test_a_slider_that_moves_draws_the_picture_anew(shown: list[dict[str, Any]], boxes: list[ipywidgets.VBox]) -> None:
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


def test_each_slider_of_the_course_can_show_its_first_value() -> None:
    """The slider of 12 stood at 2.04 above a picture of 2.0."""
    text = "".join(path.read_text() for path in (KIT / "notebooks" / "source").glob("[0-9]*.py"))
    ranges = re.findall(r"(\w+)=\(([-\d.]+), ([-\d.]+), ([-\d.]+)\)", "".join(re.findall(r"^ *slide\(.*", text, re.M)))
    assert len(ranges) >= 8
    for name, *numbers in ranges:
        low, high, first = map(float, numbers)
        size = step(low, high, first)
        steps = (first - low) / size, (high - low) / size
        assert steps == pytest.approx([round(one) for one in steps], abs=1e-6), name
        assert 25 < steps[1] < 300, name
