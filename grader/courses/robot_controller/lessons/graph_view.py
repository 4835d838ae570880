"""The running nodes and topics as a picture: who publishes and who subscribes what, and which ends do not fit."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from statistics import fmean
from typing import Any

from grader.words import mark, say
from sim.views import png

_OF_EVERY_NODE = {"/parameter_events", "/rosout"}
_PATIENCE_S = 10.0
_REST_S = 0.5  # a graph that has not changed for so long is known
_ALONE_S = 3.3  # nodes announce themselves every 3 s
_COLORS = {"node": "#0072B2", "topic": "#333333", "publishes": "#0072B2", "subscribes": "#009E73", "trouble": "#D55E00"}


@dataclass(frozen=True, order=True)
class Link:
    """One end of a topic: a node that publishes or subscribes it. `trouble` says why it is not connected to others."""

    node: str
    topic: str
    type: str
    publishes: bool
    trouble: str = ""

    def __str__(self) -> str:
        ends = (self.node, self.topic) if self.publishes else (self.topic, self.node)
        return f"{' -> '.join(ends)}  [{self.type}]" + (f"  {self.trouble}" if self.trouble else "")


class GraphView:
    """Nodes (ovals), topics (boxes) and the links between them. A notebook shows it as a picture."""

    def __init__(self, nodes: list[str], links: list[Link]) -> None:
        self.nodes, self.links = nodes, links

    def __repr__(self) -> str:
        lonely = [node for node in self.nodes if node not in {link.node for link in self.links}]
        return "\n".join([*map(str, self.links), *lonely]) or say("no nodes")

    def _repr_png_(self) -> tuple[bytes, dict[str, str]]:
        return png(_draw(self)), {"alt": say("Nodes and topics: {links}", links=repr(self).replace("\n", "; "))}


def graph_view(nodes: int = 0) -> GraphView:
    """Return the nodes that run in your domain and their topics, once `nodes` of them (or those there are) are known.

    Topics that each node has, and nodes whose names begin with an underscore, are left out.
    """
    with watcher() as seen:
        return look(seen, nodes)


@contextmanager
def watcher() -> Iterator[Any]:
    """Yield a hidden node in a context of its own, so that whatever the kernel does with rclpy is left alone."""
    import rclpy
    from rclpy.context import Context
    from rclpy.utilities import try_shutdown

    context = Context()
    rclpy.init(context=context)
    node = rclpy.create_node("_watcher", context=context, enable_rosout=False, start_parameter_services=False)
    try:
        yield node
    finally:
        node.destroy_node()
        try_shutdown(context=context)


def names(seen: Any) -> list[str]:
    """Return the nodes' full names, each once for each node that has it."""
    pairs = seen.get_node_names_and_namespaces()
    return sorted(f"{space.rstrip('/')}/{name}" for name, space in pairs if not name.startswith("_"))


def look(seen: Any, nodes: int = 0) -> GraphView:
    """Return what the node `seen` sees, once `nodes` nodes are there and nothing changes any more."""
    began = changed = time.monotonic()
    last = GraphView([], [])
    while (now := time.monotonic()) < began + _PATIENCE_S:
        view = GraphView(names(seen), links(seen))
        if repr(view) != repr(last) or view.nodes != last.nodes:
            last, changed = view, now
        # Names and ends travel apart, and each node publishes /parameter_events.
        whole = seen.count_publishers("/parameter_events") == len(seen.get_node_names())
        enough = len(view.nodes) >= nodes if nodes else bool(view.nodes) or now > began + _ALONE_S
        if whole and enough and now > changed + _REST_S:
            break
        time.sleep(0.05)
    return last


def links(seen: Any) -> list[Link]:
    """Return each end of each topic, but of those that every node has."""
    found = []
    for topic, _ in seen.get_topic_names_and_types():
        if topic in _OF_EVERY_NODE or "/_" in topic:
            continue
        sent, heard = seen.get_publishers_info_by_topic(topic), seen.get_subscriptions_info_by_topic(topic)
        for end in (*sent, *heard):
            publishes = end in sent
            others = heard if publishes else sent
            trouble = next((why for other in others if (why := _trouble(*(end, other)[:: 1 if publishes else -1]))), "")
            name = f"{end.node_namespace.rstrip('/')}/{end.node_name}"
            if not end.node_name.startswith("_"):
                found.append(Link(name, topic, end.topic_type, publishes, trouble))
    return sorted(set(found))


def _trouble(publisher: Any, subscription: Any) -> str:
    """Return why two ends of a topic are not connected; "" if they are."""
    from rclpy.qos import QoSCompatibility, qos_check_compatible

    if publisher.topic_type != subscription.topic_type:
        return say("types differ: {sent} and {asked}", sent=publisher.topic_type, asked=subscription.topic_type)
    offered, asked = publisher.qos_profile, subscription.qos_profile
    if qos_check_compatible(offered, asked)[0] != QoSCompatibility.ERROR:
        return ""
    pairs = [(getattr(offered, name), getattr(asked, name)) for name in ("reliability", "durability")]
    names = [(sent.name.lower(), wanted.name.lower()) for sent, wanted in pairs if sent != wanted]
    words = mark("{sent} offered, {asked} asked")
    return f"QoS: {', '.join(say(words, sent=sent, asked=wanted) for sent, wanted in names)}"


def _draw(view: GraphView) -> Any:
    """Return a figure: nodes on the left, topics on the right, in an order in which few links cross."""
    from matplotlib.figure import Figure

    topics = sorted(
        {link.topic for link in view.links},
        key=lambda topic: (fmean(view.nodes.index(k.node) for k in view.links if k.topic == topic), topic),
    )
    shown = list(dict.fromkeys(view.nodes))
    rows = max(1.4 * len(topics), len(shown), 1.0)
    figure = Figure(figsize=(9.0, 0.45 * rows + 0.8), layout="constrained")
    axes = figure.add_subplot(xlim=(0, 9), ylim=(-0.2, rows))
    axes.axis("off")
    at = {name: rows * (1 - (i + 0.5) / len(shown)) for i, name in enumerate(shown)}
    place = {name: rows * (1 - (i + 0.5) / len(topics)) for i, name in enumerate(topics)}
    for name, y in at.items():
        count = view.nodes.count(name)
        text = name if count == 1 else say("{name}, {count} times", name=name, count=count)
        _label(axes, 2.6, y, text, "trouble" if count > 1 else "node", "round,pad=0.4,rounding_size=0.8", "right")
    for name, y in place.items():
        types = sorted({link.type for link in view.links if link.topic == name})
        text = f"{name}\n{', '.join(types)}"
        _label(axes, 5.0, y, text, "trouble" if types[1:] else "topic", "square,pad=0.4", "left")
    for link in view.links:
        kind = "trouble" if link.trouble else "publishes" if link.publishes else "subscribes"
        lift = 0.1 if link.publishes else -0.1
        ends = [(2.8, at[link.node] + lift), (4.8, place[link.topic] + lift)]
        start, end = ends if link.publishes else ends[::-1]
        style = {"arrowstyle": "-|>", "color": _COLORS[kind], "linestyle": "--" if link.trouble else "-"}
        axes.annotate("", end, start, arrowprops=style)
    legend = say("to the right: publishes; to the left: subscribes; dashed: this end is not connected")
    troubles = dict.fromkeys(f"{link.topic}: {link.trouble}" for link in view.links if link.trouble)
    figure.supxlabel("\n".join([legend, *troubles]), fontsize=9, color=_COLORS["trouble" if troubles else "topic"])
    return figure


def _label(axes: Any, x: float, y: float, text: str, kind: str, shape: str, side: str) -> None:
    box = {"boxstyle": shape, "facecolor": "white", "edgecolor": _COLORS[kind]}
    axes.text(x, y, text, ha=side, va="center", fontsize=9, color=_COLORS[kind], bbox=box)
