"""Compare what the running graph shows of a node with the contract: topics, services, actions and their types."""

from __future__ import annotations

from collections.abc import Iterable

from grader.checks.judge import NAMESPACE, Judge, absolute, near_miss
from grader.course import Course, Node
from grader.evidence import Graph
from grader.words import mark, say

_TRY = mark("compare the names, types and directions with the contract's table letter by letter")


def expect_interfaces(judge: Judge, nodes: Iterable[Node]) -> None:
    """Give the share of the nodes' topics, services and actions that the graph shows as the contract has them."""
    wrong, count = [], 0
    for node in nodes:
        graph = judge.graph(f"idle_{node.name}")
        count += len(node.names)
        wrong += [*_wrong_topics(judge.course, graph, node), *_wrong_offers(judge.course, graph, node)]
        wrong += _absolute(judge, graph, node)
    if wrong:
        judge.share(1 - len(wrong) / count, "; ".join(wrong), _TRY)


def _wrong_topics(course: Course, graph: Graph, node: Node) -> list[str]:
    wrong = []
    topics = {name: ("subscription", type_) for name, type_ in node.subscribes.items()}
    topics |= {name: ("publisher", type_) for name, type_ in node.publishes.items()}
    for topic, (kind, type_) in topics.items():
        message = course.full_type(type_)
        found = [endpoint for endpoint in graph.endpoints if endpoint.topic == topic]
        if any(e.kind == kind and _same_type(e.type, message, course) for e in found):
            continue
        if found:
            seen = ", ".join(say("{e.kind} of {e.type}", e=e) for e in found)
        else:
            others = sorted({e.topic for e in graph.endpoints if e.kind == kind and e.type == message} - set(topics))
            seen = say("found {others}", others=", ".join(others)) if others else say("found nothing similar")
        wrong.append(
            say("expected a {kind} of {topic} ({message}); {seen}", kind=kind, topic=topic, message=message, seen=seen)
        )
    return wrong


def _wrong_offers(course: Course, graph: Graph, node: Node) -> list[str]:
    wrong, offered = [], {**graph.services, **graph.actions}
    for name, type_ in node.offers.items():
        short = type_.rpartition("/")[2]
        # Another check judges which package the type is from.
        if not any(found.rpartition("/")[2] == short for found in offered.get(name, [])):
            what = "action" if name in node.actions else "service"
            wrong.append(
                say(
                    "expected {what} {name} ({short}){near_miss}",
                    what=what,
                    name=name,
                    short=short,
                    near_miss=near_miss(graph, name, course.offered),
                )
            )
    return wrong


def _absolute(judge: Judge, usual: Graph, node: Node) -> list[str]:
    """Return in words the names that stay the same in a namespace, of those that the node has outside of one."""
    trial = judge.in_namespace
    graph = None if trial is None else trial.graph if trial.node == node.name else trial.other_graph
    present = {endpoint.topic for endpoint in usual.endpoints} | {*usual.services, *usual.actions}
    return [
        say(
            "in the namespace /{namespace} there is still /{name}: it is an absolute name, and {name!r} a relative one",
            namespace=NAMESPACE,
            name=name,
        )
        for name in node.names
        if name in present and absolute(graph, name)
    ]


def _same_type(found: str, wanted: str, course: Course) -> bool:
    if wanted.startswith(course.package):
        return found.rpartition("/")[2] == wanted.rpartition("/")[2]
    return found == wanted
