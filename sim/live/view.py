"""What a notebook shows of a running simulator: the widget while it runs, a picture of where it stands else."""

from __future__ import annotations

import base64
import io
import uuid
import weakref
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from sim.live.engine import Engine
from sim.live.feed import Message
from sim.live.widget import cell_id, new_widget
from sim.views import COLORS, View, map_view

GRACE_S = 2.0  # how long `run` waits for a front end before it goes on without
SHORT_GRACE_S = 0.2  # the same, once it has waited in vain and as long as no view has been heard of

WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"


class Live(Engine):
    """A simulator that runs beside the notebook and can be watched and steered while it does.

        Live(Simulator(load_world("office")))                    # the built-in driver; clicks become its goals
        Live(simulator, driver=my_driver)                        # a function from Seen to Twist
        Live(simulator, step=bridge.tick, on_goal=send_goal)     # a ROS node, in lockstep

    Shown as a cell's result it starts; it runs while a front end shows it, and in `run`. Without a front end it shows
    a picture of where the robot is. `stop` ends it and leaves such a picture in the saved notebook.

    Args:
        simulator: the robot. The thread steps it; to change it from a cell use `hold`.
        driver: commands the robot every 0.1 s; without it and without `step` the robot visits the world's goals.
        step: advances the simulator by the seconds it is given, for example a bridge's `tick`.
        on_goal: called with x, y (m, map frame) between two steps when the map is clicked. What it returns, if it
            is text, is shown.
        on_reset: called after the simulator was reset, for drivers and nodes that remember things.
        rate: simulated seconds per wall second to begin with; `math.inf` as fast as it goes.
        period: simulated seconds per step; without it 0.05 with `step`, a bridge's tick, else 0.025.
        fps: pictures sent per wall second at most.

    Raises:
        ValueError: driver and step are both given, or a number makes no sense.
    """

    _shown: ClassVar[weakref.WeakValueDictionary[str, Live]] = weakref.WeakValueDictionary()
    _grace_s: ClassVar[float] = GRACE_S

    # __init__ is the engine's, so that a notebook's help shows what it takes.
    _widget: Any = None
    _display_id = ""

    def picture(self) -> View:
        """Return the map with the robot where it is now and its path."""
        with self.hold():
            figure = map_view(self.simulator)
            axes = figure.axes[0]
            path = [*self._feed.path, (self.simulator.pose.x, self.simulator.pose.y)]
            axes.plot(*zip(*path, strict=True), color=COLORS["path"], linewidth=1.8, zorder=3, label="path")
            if contacts := self.simulator.contacts:
                places = np.array([c.point for c in contacts])
                axes.plot(*places.T, "X", color=COLORS["contact"], markersize=11, zorder=7, label="contact")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, fontsize=8, frameon=False)
        return figure

    # ------------------------------------------------------------- how a notebook shows it

    def __repr__(self) -> str:
        # The same at any time: stored outputs are compared (nbval).
        return f"Live view of {self.simulator.world.name!r}"

    def _repr_mimebundle_(self, **_: object) -> tuple[Message, Message]:
        """Return the widget where there is one, a picture and a text, for the front end to choose from."""
        png = io.BytesIO()
        figure = self.picture()
        figure.savefig(png, format="png", dpi=96)
        bundle: Message = {"text/plain": repr(self), "image/png": base64.b64encode(png.getvalue()).decode()}
        if self._widget is not None:
            bundle[WIDGET_VIEW] = {"version_major": 2, "version_minor": 0, "model_id": self._widget.model_id}
        return bundle, {"image/png": {"alt": figure.get_suptitle()}}

    def _ipython_display_(self) -> None:
        from IPython.display import display

        if not self._stopping:
            self._replace_older()
            self._open_widget()
            self._start_thread()
        self._display_id = self._display_id or uuid.uuid4().hex
        bundle, metadata = self._repr_mimebundle_()
        display(bundle, metadata=metadata, raw=True, display_id=self._display_id)  # type: ignore[no-untyped-call]

    def _show_picture(self) -> None:
        """Put a picture of the present state where the view is, so that the saved notebook shows it anywhere."""
        if self._display_id:
            from IPython.display import update_display

            bundle, metadata = self._repr_mimebundle_()
            bundle.pop(WIDGET_VIEW, None)
            update_display(bundle, metadata=metadata, raw=True, display_id=self._display_id)  # type: ignore[no-untyped-call]

    def _open_widget(self) -> None:
        if self._widget is None:
            self._widget = new_widget()
        if self._widget is not None and self._audience.channel is None:
            self._audience.channel = self._widget
            self._widget.on_msg(lambda _widget, content, _buffers: self.receive(content))
            self._widget.observe(self._notice_closing, "comm")
            comm = self._widget.comm
            comm.on_close(lambda _message: self.stop())
            # JupyterLab sends commands to a thread of their own (a subshell). ipykernel 7 would hand them to whichever
            # thread the comm spoke from last, the main one, which a cell may keep busy with a student's node.
            comm._reply_subshell_for = lambda _data, wanted: wanted

    def _notice_closing(self, change: Mapping[str, object]) -> None:
        if change["new"] is None:
            self.stop()

    def _replace_older(self) -> None:
        """Stop the view that this cell showed when it was run before."""
        cell = cell_id()
        if cell:
            older = self._shown.get(cell)
            if older is not None and older is not self:
                older._display_id = ""  # its output has been cleared
                older.stop()
            self._shown[cell] = self

    # ------------------------------------------------------------- what the engine tells

    def receive(self, content: object) -> None:
        """Take a message from the browser; it is obeyed between two steps. What is no command is left alone."""
        super().receive(content)
        if self._seen_view.is_set():
            Live._grace_s = GRACE_S

    def _about_to_run(self) -> None:
        if self._widget is not None and not self._seen_view.wait(Live._grace_s):
            Live._grace_s = SHORT_GRACE_S

    def _has_run(self) -> None:
        if not self._seen_view.is_set():
            self._show_picture()

    def _has_stopped(self) -> None:
        if self._display_id:
            self._audience.send(self._clock(), self._state())
            self._show_picture()
        widget, self._widget, self._audience.channel = self._widget, None, None
        if widget is not None:
            widget.close()
