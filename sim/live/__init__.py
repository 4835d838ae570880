"""The live view for Jupyter: a thread drives the robot while the kernel stays free; a widget shows and steers it.

| module | job |
|---|---|
| `view` | `Live`, which a notebook creates and shows: widget, picture, the end |
| `engine` | the thread: executes commands between two steps, paces the steps, ends a run |
| `audience` | the open views: which ones there are, when the next frame is due |
| `protocol` | the messages to and from the browser |

Each imports only the modules below it. Nothing is fetched from the network: view.js and view.css are in this folder.
No ROS here; a bridge's `tick` is a `step` like any other.
"""

from sim.live.view import Live

__all__ = ["Live"]
