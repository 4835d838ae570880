"""Look at the running graph: which endpoints, services and actions a node shows. Reads only."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.action.graph import get_action_server_names_and_types_by_node
from rclpy.node import Node
from rclpy.qos import QoSReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from grader.evidence import Endpoint, Graph

# Every rclpy node has these; they say nothing about the student's work.
_RCLPY_SERVICES = (
    "describe_parameters", "get_parameter_types", "get_parameters", "list_parameters", "set_parameters",
    "set_parameters_atomically", "get_type_description",
)  # fmt: skip


def look(observer: Node, node_name: str) -> Graph:
    """Return what the graph shows of `node_name`, seen by `observer`. Names carry no leading slash."""
    names = [f"{space.rstrip('/')}/{name}" for name, space in observer.get_node_names_and_namespaces()]
    own = [name for name in names if not name.endswith(f"/{observer.get_name()}")]
    found = next((name for name in own if name.rpartition("/")[2] == node_name), None)
    if found is None:
        return Graph(nodes=sorted(name.lstrip("/") for name in own))
    space, _, name = found.rpartition("/")
    space = space or "/"
    try:
        services = dict(observer.get_service_names_and_types_by_node(name, space))
        actions = dict(get_action_server_names_and_types_by_node(observer, name, space))
    except RuntimeError:  # the node left while we looked
        return Graph(nodes=sorted(name.lstrip("/") for name in own))
    return Graph(
        nodes=sorted(name.lstrip("/") for name in own),
        endpoints=_endpoints(observer, node_name),
        services={
            service.lstrip("/"): list(types)
            for service, types in services.items()
            if service.rpartition("/")[2] not in _RCLPY_SERVICES and "/_action/" not in service
        },
        actions={action.lstrip("/"): list(types) for action, types in actions.items()},
    )


def foreign_publishers(observer: Node, topics: Sequence[str], seen: Sequence[str] = ()) -> list[str]:
    """Return who else publishes `topics`, of which the observer's own node is the only rightful publisher.

    Those `seen` before stay: who published a false clock for a moment has done so.
    """
    found = list(seen)
    for topic in topics:
        own = 0
        for info in observer.get_publishers_info_by_topic(topic)[:_MOST]:
            # One that bears our name is no more welcome: there is one of ours for each topic.
            own += info.node_name == observer.get_name()
            if info.node_name != observer.get_name() or own > 1:
                found.append(f"{topic} by {info.node_name}"[:200])
    return list(dict.fromkeys(found))[:_MOST]


_MOST = 20


def _endpoints(observer: Node, node_name: str) -> list[Endpoint]:
    found = []
    asks = (
        ("publisher", observer.get_publishers_info_by_topic),
        ("subscription", observer.get_subscriptions_info_by_topic),
    )
    for topic, _ in observer.get_topic_names_and_types():
        for kind, ask in asks:
            try:
                infos = ask(topic)
            except ValueError:
                continue  # a name that rclpy itself takes for none: somebody made it without rclpy
            for info in infos:
                if info.node_name == node_name:
                    found.append(_endpoint(topic, kind, info))
    return sorted(found, key=lambda endpoint: (endpoint.topic, endpoint.kind))


def _endpoint(topic: str, kind: str, info: TopicEndpointInfo) -> Endpoint:
    best_effort = info.qos_profile.reliability == QoSReliabilityPolicy.BEST_EFFORT
    return Endpoint(
        topic=topic.lstrip("/"),
        kind=kind,
        node=info.node_name,
        type=info.topic_type,
        type_hash=str(info.topic_type_hash),
        reliability="best_effort" if best_effort else "reliable",
    )
