"""Read the running graph: the endpoints, services and actions of a node, and who else publishes a topic."""

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
_MAX_FOREIGN = 20


def snapshot(observer: Node, node_name: str) -> Graph:
    """Return what the graph shows of `node_name`, seen by `observer`. Names have no leading slash."""
    names = [f"{space.rstrip('/')}/{name}" for name, space in observer.get_node_names_and_namespaces()]
    others = [name for name in names if not name.endswith(f"/{observer.get_name()}")]
    nodes = sorted(name.lstrip("/") for name in others)
    found = next((name for name in others if name.rpartition("/")[2] == node_name), None)
    if found is None:
        return Graph(nodes=nodes)
    space, _, name = found.rpartition("/")
    space = space or "/"
    try:
        services = dict(observer.get_service_names_and_types_by_node(name, space))
        actions = dict(get_action_server_names_and_types_by_node(observer, name, space))
    except RuntimeError:  # the node left in the meantime
        return Graph(nodes=nodes)
    return Graph(
        nodes=nodes,
        endpoints=endpoints(observer, node_name),
        services={
            service.lstrip("/"): list(types)
            for service, types in services.items()
            if service.rpartition("/")[2] not in _RCLPY_SERVICES and "/_action/" not in service
        },
        actions={action.lstrip("/"): list(types) for action, types in actions.items()},
    )


def foreign_publishers(observer: Node, topics: Sequence[str], seen: Sequence[str] = ()) -> list[str]:
    """Return who else publishes `topics`, which only the observer's own node should publish.

    Those `seen` before stay in the list: publishing a false clock for a moment is enough.
    """
    found = list(seen)
    for topic in topics:
        own = 0
        for info in observer.get_publishers_info_by_topic(topic)[:_MAX_FOREIGN]:
            # A second publisher under our own name is foreign too: we have one for each topic.
            own += info.node_name == observer.get_name()
            if info.node_name != observer.get_name() or own > 1:
                found.append(f"{topic} by {info.node_name}"[:200])
    return list(dict.fromkeys(found))[:_MAX_FOREIGN]


def endpoints(observer: Node, node_name: str) -> list[Endpoint]:
    """Return the publishers and subscriptions of `node_name`, sorted by topic and kind."""
    found = []
    queries = (
        ("publisher", observer.get_publishers_info_by_topic),
        ("subscription", observer.get_subscriptions_info_by_topic),
    )
    for topic, _ in observer.get_topic_names_and_types():
        for kind, query in queries:
            try:
                infos = query(topic)
            except ValueError:
                continue  # rclpy rejects the topic's name, so it was created without rclpy
            found += [_endpoint(topic, kind, info) for info in infos if info.node_name == node_name]
    return sorted(found, key=lambda endpoint: (endpoint.topic, endpoint.kind))


def _endpoint(topic: str, kind: str, info: TopicEndpointInfo) -> Endpoint:
    best_effort = info.qos_profile.reliability == QoSReliabilityPolicy.BEST_EFFORT
    return Endpoint(
        topic=topic.lstrip("/"),
        kind=kind,
        node=info.node_name,
        type=info.topic_type,
        reliability="best_effort" if best_effort else "reliable",
    )
