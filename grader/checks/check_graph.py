"""What the running graph shows."""

from __future__ import annotations

from collections.abc import Iterable

from grader.checks.judge import Judge
from grader.checks.wording import NAMESPACE, absolute, near_miss, wrong_topics
from grader.course import Course, Node
from grader.evidence import Graph, Kind, Reason
from grader.words import mark, say

NEEDS = ("idle",)
_TRY = mark("compare the names, types and directions with the contract's table letter by letter")


def test_nodes_show_the_contracts_interfaces(judge: Judge) -> None:
    """The running graph shows each node with the contract's topics, types, services and actions."""
    expect_interfaces(judge, judge.course.nodes.values())


def test_sensor_subscriptions_match_best_effort(judge: Judge) -> None:
    """Sensor subscriptions also match best-effort publishers, as real drivers use."""
    reliable = [
        end.topic
        for node in judge.course.nodes.values()
        for end in judge.graph(f"idle_{node.name}").endpoints
        if end.kind == "subscription"
        and end.reliability == "reliable"
        and end.topic in [*node.subscribes, *node.publishes]
    ]
    words = mark("these subscriptions receive nothing from best-effort publishers: {reliable}")
    seen, try_ = say(words, reliable=", ".join(reliable)), say("subscribe with qos_profile_sensor_data")
    judge.expect(not reliable, seen, try_, Reason(Kind.UNHEARD))


def expect_interfaces(judge: Judge, nodes: Iterable[Node]) -> None:
    """Give the share of the nodes' topics, services and actions that the graph shows as the contract has them."""
    wrong, count = [], 0
    for node in nodes:
        graph = judge.graph(f"idle_{node.name}")
        count += len(node.names)
        wrong += [*(words for _, words, _ in wrong_topics(judge.course, graph, node))]
        wrong += [*_wrong_offers(judge.course, graph, node), *_absolute(judge, graph, node)]
    if wrong:
        judge.share(1 - len(wrong) / count, "; ".join(wrong), _TRY)


def _wrong_offers(course: Course, graph: Graph, node: Node) -> list[str]:
    wrong, offered = [], {**graph.services, **graph.actions}
    for name, type_ in node.offers.items():
        short = type_.rpartition("/")[2]
        # Another check judges which package the type is from.
        if not any(found.rpartition("/")[2] == short for found in offered.get(name, [])):
            what = "action" if name in node.actions else "service"
            words = mark("expected {what} {name} ({short}){near_miss}")
            near = near_miss(graph, name, course.offered)
            wrong.append(say(words, what=what, name=name, short=short, near_miss=near))
    return wrong


def _absolute(judge: Judge, usual: Graph, node: Node) -> list[str]:
    """Return in words the names that stay the same in a namespace, of those that the node has outside of one."""
    trial = judge.in_namespace
    graph = None if trial is None else trial.graph if trial.node == node.name else trial.other_graph
    present = {endpoint.topic for endpoint in usual.endpoints} | {*usual.services, *usual.actions}
    still = [name for name in node.names if name in present and absolute(graph, name)]
    words = mark("in the namespace /{ns} there is still /{name}: it is an absolute name, and {name!r} a relative one")
    return [say(words, ns=NAMESPACE, name=name) for name in still]
