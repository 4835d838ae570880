"""`Live`: a notebook's view of a running simulator, the widget while it runs and a picture of its state otherwise."""

from __future__ import annotations

import base64
import uuid
import weakref
from collections.abc import Mapping
from importlib.resources import files
from typing import Any, ClassVar

import numpy as np

from sim.live.engine import Engine
from sim.live.protocol import Message
from sim.views import COLORS, View, map_view, png

GRACE_S = 2.0  # how long `run` waits for a front end before it runs without one
SHORT_GRACE_S = 0.2  # the same, after waiting in vain once and until a view is heard from

WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"


class Live(Engine):
    """A simulator that runs beside the notebook and can be watched and steered while it does.

        Live(Simulator(load_world("office")))                    # the built-in driver; clicks become its goals
        Live(simulator, driver=my_driver)                        # a function from Seen to Twist
        Live(simulator, step=bridge.tick, on_goal=send_goal)     # a ROS node, in lockstep

    It starts when it is shown as a cell's result, and runs while a front end shows it and during `run`. Without a
    front end it shows a picture of the robot's position. `stop` ends it and leaves such a picture in the notebook.

    Args:
        simulator: the robot. The thread steps it; to change it from a cell use `hold`.
        driver: commands the robot every 0.1 s. Without it and without `step` the robot visits the world's goals.
        step: advances the simulator by the given number of seconds, for example a bridge's `tick`.
        on_goal: called between two steps with x, y (m, map frame) when the map is clicked. If it returns text, the
            text is shown.
        on_reset: called after the simulator has been reset, for drivers and nodes that keep state.
        rate: initial simulated seconds per wall second; `math.inf` for as fast as possible.
        period: simulated seconds per step; the default is 0.05 with `step` (a bridge's tick), else 0.025.
        fps: maximum number of frames sent per wall second.

    Raises:
        ValueError: driver and step are both given, or a number is out of range.
    """

    # The views by their cells and by their displays.
    _shown: ClassVar[weakref.WeakValueDictionary[str, Live]] = weakref.WeakValueDictionary()
    _grace_s: ClassVar[float] = GRACE_S

    # No __init__ here: the engine's shows the arguments in a notebook's help.
    _widget: Any = None
    _display_id = ""

    def picture(self) -> View:
        """Return the map with the robot at its current position and its path."""
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

    # ------------------------------------------------------------- display

    def __repr__(self) -> str:
        # The same at any time: stored outputs are compared (nbval).
        return f"Live view of {self.simulator.world.name!r}"

    def _repr_mimebundle_(self, **_: object) -> tuple[Message, Message]:
        """Return a text, a picture and, if there is one, the widget; the front end chooses."""
        figure = self.picture()
        bundle: Message = {"text/plain": repr(self), "image/png": base64.b64encode(png(figure)).decode()}
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
        self._shown[self._display_id] = self
        bundle, metadata = self._repr_mimebundle_()
        display(bundle, metadata=metadata, raw=True, display_id=self._display_id)  # type: ignore[no-untyped-call]

    def _show_picture(self) -> None:
        """Replace the view by a picture of the current state, which a saved notebook shows anywhere."""
        if self._display_id:
            from IPython.display import update_display

            bundle, metadata = self._repr_mimebundle_()
            bundle.pop(WIDGET_VIEW, None)
            update_display(bundle, metadata=metadata, raw=True, display_id=self._display_id)  # type: ignore[no-untyped-call]

    def _open_widget(self) -> None:
        if self._widget is None:
            self._widget = _new_widget()
        if self._widget is not None and self._audience.channel is None:
            self._audience.channel = self._widget
            self._widget.on_msg(lambda _widget, content, _buffers: self.receive(content))
            self._widget.observe(self._stop_when_closed, "comm")
            comm = self._widget.comm
            comm.on_close(lambda _message: self.stop())
            # JupyterLab sends commands to a thread of their own (a subshell). ipykernel 7 would pass them on to the
            # thread that last used the comm, the main thread, which a cell may keep busy with a student's node.
            comm._reply_subshell_for = lambda _data, wanted: wanted

    def _stop_when_closed(self, change: Mapping[str, object]) -> None:
        if change["new"] is None:
            self.stop()

    def _replace_older(self) -> None:
        """Stop the view that an earlier run of this cell showed."""
        cell = str(_cell_request().get("metadata", {}).get("cellId", ""))
        if cell:
            older = self._shown.get(cell)
            if older is not None and older is not self:
                older._display_id = ""  # its output has been cleared
                older.stop()
            self._shown[cell] = self

    # ------------------------------------------------------------- the engine's hooks

    def receive(self, content: object) -> None:
        """Queue a message from the browser, to be executed between two steps. Invalid messages are ignored."""
        super().receive(content)
        if self._seen_view.is_set():
            Live._grace_s = GRACE_S

    def _before_run(self) -> None:
        if self._widget is not None and not self._seen_view.wait(Live._grace_s):
            Live._grace_s = SHORT_GRACE_S

    def _after_run(self) -> None:
        if not self._seen_view.is_set():
            self._show_picture()

    def _after_stop(self) -> None:
        if self._display_id:
            self._audience.send(self._clock(), self._state())
            self._show_picture()
        widget, self._widget, self._audience.channel = self._widget, None, None
        if widget is not None:
            widget.close()


def _new_widget() -> Any:
    """Return the widget, None without a kernel or without anywidget."""
    if not _cell_request():
        return None
    try:
        import anywidget
    except ImportError:
        return None
    here = files("sim.live")

    class LiveView(anywidget.AnyWidget):
        _esm = here.joinpath("view.js").read_text(encoding="utf-8")
        _css = here.joinpath("view.css").read_text(encoding="utf-8")

    return LiveView()


def _cell_request() -> Mapping[str, Any]:
    """Return the execute request of the cell that is running, an empty mapping outside a kernel."""
    from IPython.core.getipython import get_ipython

    shell = get_ipython()
    if shell is None or not hasattr(shell, "get_parent"):
        return {}
    message = shell.get_parent()
    return message if isinstance(message, Mapping) else {}
