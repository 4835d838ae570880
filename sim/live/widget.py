"""The widget in the front end, and the cell that shows it. Only here the kernel and anywidget are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any


def new_widget() -> Any:
    """Return the widget; None where there is no kernel to talk to, or no anywidget."""
    if not _cell_message():
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


def _cell_message() -> Mapping[str, Any]:
    """Return the front end's request that is being executed, nothing outside a kernel."""
    from IPython.core.getipython import get_ipython

    shell = get_ipython()
    if shell is None or not hasattr(shell, "get_parent"):
        return {}
    message = shell.get_parent()
    return message if isinstance(message, Mapping) else {}


def cell_id() -> str:
    """Return the id of the cell that is being executed, "" outside a notebook."""
    return str(_cell_message().get("metadata", {}).get("cellId", ""))
