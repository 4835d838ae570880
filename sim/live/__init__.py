"""The live view for Jupyter: the robot drives in a thread while the kernel stays free; a widget shows and steers it.

| module | job |
|---|---|
| `view` | `Live`, what a notebook calls and shows: widget, picture, the end |
| `engine` | the thread: obeys commands between two steps, keeps the speed, ends a run |
| `audience` | the open views: which there are, when the next picture is due, what it says |
| `commands` | which command a browser's message is |
| `feed` | what a browser must know of the simulator, and then only what changed |
| `drivers` | who drives where no node does |
| `pacer` | when the next step is due |
| `widget` | anywidget and the kernel |

Each imports only what stands below it. Nothing comes from the network: view.js and view.css lie beside this file.
No ROS here; a bridge's `tick` is a `step` like any other.
"""

from sim.live.audience import HIDDEN_LOST_S, LOST_S, UNHEARD_LOST_S, Channel
from sim.live.drivers import CONTROL_S, Drive, Guide
from sim.live.feed import NO_RANGE, PROTOCOL, Feed, Message
from sim.live.pacer import Pacer
from sim.live.view import Live

__all__ = [
    "CONTROL_S",
    "HIDDEN_LOST_S",
    "LOST_S",
    "NO_RANGE",
    "PROTOCOL",
    "UNHEARD_LOST_S",
    "Channel",
    "Drive",
    "Feed",
    "Guide",
    "Live",
    "Message",
    "Pacer",
]
