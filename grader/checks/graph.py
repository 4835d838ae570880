"""Read a running graph against the contract, in words: other names, other types, absolute names."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from grader.course import Course, Node
from grader.evidence import Graph
from grader.words import mark, say

NAMESPACE = "robot7"
"""Where a trial with a launch file of the course's own has put the nodes."""
_OF_EVERY_NODE = {"rosout", "parameter_events"}


def wrong_topics(course: Course, graph: Graph, node: Node) -> Iterator[tuple[str, str, bool]]:
    """Yield each topic of the contract that the graph does not show as the contract has it, and that in words.

    The third is whether the graph shows something instead: the topic with another type, or its type elsewhere.
    """
    topics = {name: ("publisher", type_) for name, type_ in node.publishes.items()}
    topics |= {name: ("subscription", type_) for name, type_ in node.subscribes.items()}
    for topic, (kind, type_) in topics.items():
        message = course.full_type(type_)
        found = [endpoint for endpoint in graph.endpoints if endpoint.topic == topic]
        if any(e.kind == kind and _same_type(e.type, message, course) for e in found):
            continue
        others = sorted({e.topic for e in graph.endpoints if e.kind == kind and e.type == message} - set(topics))
        seen = say("found {others}", others=", ".join(others)) if others else say("found nothing similar")
        if found:
            seen = say("found {others}", others=", ".join(say("{e.kind} of {e.type}", e=e) for e in found))
        words = mark("expected a {kind} of {topic} ({message}); {seen}")
        yield topic, say(words, kind=kind, topic=topic, message=message, seen=seen), bool(found or others)


def _same_type(found: str, wanted: str, course: Course) -> bool:
    if wanted.startswith(course.package):
        return found.rpartition("/")[2] == wanted.rpartition("/")[2]
    return found == wanted


def absolute(graph: Graph | None, name: str) -> bool:
    """Return whether a node that runs in NAMESPACE has a topic, service or action of this name outside of it."""
    if graph is None:
        return False
    names = {endpoint.topic for endpoint in graph.endpoints} | {*graph.services, *graph.actions}
    return name in names and f"{NAMESPACE}/{name}" not in names


def near_miss(graph: Graph | None, wanted: str, contract: Collection[str]) -> str:
    """Return words that name the services and actions found instead of `wanted`, "" if there are none.

    None of those in the `contract` is a near miss of another.
    """
    if graph is None:
        return ""
    offered = {**graph.services, **graph.actions}
    if wanted in offered:
        return say("; found {wanted} of type {short_types}", wanted=wanted, short_types=short_types(offered[wanted]))
    others = {name: types for name, types in offered.items() if name not in contract}
    if not others:
        return ""
    return say("; found ") + ", ".join(f"{name} ({short_types(types)})" for name, types in sorted(others.items())[:4])


def near_topic(graph: Graph | None, wanted: str) -> str:
    """Return words that name the topics published instead of `wanted`, "" if there are none."""
    names = sorted({e.topic for e in graph.endpoints if e.kind == "publisher"} - _OF_EVERY_NODE) if graph else []
    if wanted in names:
        return say("; {wanted} is on the graph, but no message came", wanted=wanted)
    return say("; the node publishes {names}", names=", ".join(names)) if names else ""


def short_types(types: Sequence[str]) -> str:
    """Return "SetBool" for ["std_srvs/srv/SetBool"]; a type from a package of the robot keeps its package."""
    return ", ".join(name if "robot" in name else name.rpartition("/")[2] for name in types)
