"""A recording as a picture that moves by itself wherever pictures are shown, in a saved notebook too.

It is an animated PNG: pages that show notebooks keep PNGs as they are, but drop scripts and other animated formats.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray
from PIL import Image

from sim.recording import Recording
from sim.views import COLORS, draw_contacts, draw_goals, draw_moment, draw_obstacles, framed, map_view

FRAME_S = 0.125
LONGEST_S = 10.0  # a longer recording plays faster
_LAST_MS = 2000  # the last frame stays for a while, then the film begins again
_DPI = 72
_COLORS = 32


class Film:
    """A recording as a film of the map that plays over and over. A notebook shows it as a result.

    `speed` is how many times as fast as the robot it plays.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self.speed = max(1, math.ceil(recording.duration / LONGEST_S))

    def __repr__(self) -> str:
        r = self._recording
        return (
            f"A film of {r.duration:.1f} s in {r.world.name!r}: from ({r.x[0]:z.1f}, {r.y[0]:z.1f}) to "
            f"({r.x[-1]:z.1f}, {r.y[-1]:z.1f}), {r.distance:.1f} m driven, {len(r.contacts)} contacts"
        )

    def _repr_png_(self) -> tuple[bytes, dict[str, str]]:
        return self.png(), {"alt": repr(self)}

    def png(self) -> bytes:
        """Return an animated PNG. Where it does not play, it is a picture of the whole way."""
        r = self._recording
        figure = framed(map_view(r, title=""))
        figure.set_dpi(_DPI)
        # The robot fits in at the end; so it must on its way.
        (axes,), room = figure.axes, 1.1 * r.radius
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        axes.set_xlim(min(left, r.x.min() - room), max(right, r.x.max() + room))
        axes.set_ylim(min(low, r.y.min() - room), max(high, r.y.max() + room))
        canvas: Any = FigureCanvasAgg(figure)  # matplotlib's canvas is untyped
        canvas.draw()
        still = _pixels(canvas)
        reduce = _Palette(still)
        frames = [reduce(pixels) for pixels in self._frames(canvas)]
        stream = io.BytesIO()
        reduce(still).save(
            stream, "png", save_all=True, default_image=True, append_images=frames, optimize=True,
            duration=[*[round(1000 * FRAME_S)] * (len(frames) - 1), _LAST_MS],
        )  # fmt: skip
        return stream.getvalue()

    def _frames(self, canvas: Any) -> Iterator[NDArray[np.uint8]]:
        """Yield the map at one moment after another. What does not change is drawn once."""
        r, axes = self._recording, canvas.figure.axes[0]
        canvas.figure.set_layout_engine("none")
        axes.autoscale(False)
        for artist in (*axes.lines, *axes.patches, *axes.collections, *axes.texts):
            artist.remove()
        if legend := axes.get_legend():
            legend.remove()
        draw_goals(axes, r.world.goals)
        fixed = [p for p in r.presences if r.track(p) is None and p.since <= r.t[0] and p.until > r.t[-1]]
        draw_obstacles(axes, [p.obstacle for p in fixed])
        moving = replace(r, presences=tuple(p for p in r.presences if p not in fixed))
        canvas.draw()
        empty, permanent = canvas.copy_from_bbox(canvas.figure.bbox), set(axes.get_children())
        for t in (*np.arange(0.0, r.duration, FRAME_S * self.speed), r.duration):
            now = float(r.t[0] + t)
            done = r.index_at(now) + 1
            draw_moment(axes, moving, now)
            draw_contacts(axes, replace(r, contacts=tuple(c for c in r.contacts if c.time <= now)))
            axes.plot(r.x[:done], r.y[:done], color=COLORS["path"], linewidth=1.8, zorder=3)
            speed = f", {self.speed} times as fast" if self.speed > 1 else ""
            axes.text(0.0, 1.01, f"{t:.1f} s{speed}", transform=axes.transAxes)
            canvas.restore_region(empty)
            for artist in sorted(set(axes.get_children()) - permanent, key=lambda drawn: drawn.get_zorder()):
                axes.draw_artist(artist)
                artist.remove()
            yield _pixels(canvas)


def _pixels(canvas: Any) -> NDArray[np.uint8]:
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


class _Palette:
    """The main colours of a picture, to which others are reduced.

    Pillow's own `quantize(palette=...)` looks a colour up by its first bits, and so makes white a little grey.
    """

    def __init__(self, pixels: NDArray[np.uint8]) -> None:
        main = Image.fromarray(pixels).quantize(_COLORS, dither=Image.Dither.NONE).getpalette()
        named = [[int(color[i : i + 2], 16) for i in (1, 3, 5)] for color in COLORS.values()]
        self._colors = np.array([*np.reshape(main or [], (-1, 3)), *named], np.uint8)
        every = np.stack(np.unravel_index(np.arange(2**15), (32, 32, 32)), axis=1) * (255 / 31)
        apart = ((every[:, None] - self._colors) ** 2).sum(axis=2)
        self._nearest = apart.argmin(axis=1).astype(np.uint8)

    def __call__(self, pixels: NDArray[np.uint8]) -> Image.Image:
        red, green, blue = np.moveaxis((pixels.astype(np.uint16) * 31 + 127) // 255, 2, 0)
        picture = Image.fromarray(self._nearest[(red << 10) | (green << 5) | blue], "P")
        picture.putpalette(self._colors.tobytes())
        return picture
