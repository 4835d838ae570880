"""I4: what the running graph shows."""

from collections.abc import Iterable

from grader.checks.judge import NAMESPACE, OFFERED, Judge, absolute, near_miss
from grader.contract.spec import PACKAGE
from grader.evidence import Graph

_CONTROLLER = {
    "scan": ("subscription", "sensor_msgs/msg/LaserScan"),
    "odom": ("subscription", "nav_msgs/msg/Odometry"),
    "cmd_vel": ("publisher", "geometry_msgs/msg/Twist"),
}
_PROCESSOR = {
    "raw_scan": ("subscription", "sensor_msgs/msg/LaserScan"),
    "imu/data": ("subscription", "sensor_msgs/msg/Imu"),
    "battery/state": ("subscription", "sensor_msgs/msg/BatteryState"),
    "sensor_fusion_data": ("publisher", f"{PACKAGE}/msg/SensorFusionData"),
    "obstacle_distance": ("publisher", "std_msgs/msg/Float32"),
}
_TRY = "compare the names, types and directions with the contract's table letter by letter"


def test_controller_shows_the_contracts_interfaces(judge: Judge) -> None:
    """The running graph shows `robot_controller` with the contract's topics, types, services and action."""
    graph = judge.graph("idle")
    wrong = _wrong_topics(graph, _CONTROLLER)
    offered = {**graph.services, **graph.actions}
    for name, type_ in OFFERED.items():
        kind, _, short = type_.partition("/")
        # I3 judges which package the type is from.
        if not any(found.rpartition("/")[2] == short for found in offered.get(name, [])):
            what = "action" if kind == "action" else "service"
            wrong.append(f"expected {what} {name} ({short}){near_miss(graph, name)}")
    wrong += _absolute(judge, "graph", graph, (*_CONTROLLER, *OFFERED))
    _share(judge, wrong, len(_CONTROLLER) + len(OFFERED))


def test_processor_shows_the_contracts_interfaces(judge: Judge) -> None:
    """The running graph shows `sensor_processor` with the contract's topics and types."""
    graph = judge.graph("idle_processor")
    wrong = _wrong_topics(graph, _PROCESSOR) + _absolute(judge, "other_graph", graph, _PROCESSOR)
    _share(judge, wrong, len(_PROCESSOR))


def test_sensor_subscriptions_match_best_effort(judge: Judge) -> None:
    """Sensor subscriptions also match best-effort publishers, as real drivers use."""
    reliable = []
    for trial, topics in (("idle", _CONTROLLER), ("idle_processor", _PROCESSOR)):
        for endpoint in judge.graph(trial).endpoints:
            if endpoint.kind == "subscription" and endpoint.topic in topics and endpoint.reliability == "reliable":
                reliable.append(endpoint.topic)
    seen = f"these subscriptions receive nothing from best-effort publishers: {', '.join(reliable)}"
    judge.expect(not reliable, seen, "subscribe with qos_profile_sensor_data")


def _wrong_topics(graph: Graph, wanted: dict[str, tuple[str, str]]) -> list[str]:
    wrong = []
    for topic, (kind, message) in wanted.items():
        found = [endpoint for endpoint in graph.endpoints if endpoint.topic == topic]
        if any(e.kind == kind and _same_type(e.type, message) for e in found):
            continue
        if found:
            seen = ", ".join(f"{e.kind} of {e.type}" for e in found)
        else:
            others = sorted({e.topic for e in graph.endpoints if e.kind == kind and e.type == message} - set(wanted))
            seen = f"found {', '.join(others)}" if others else "found nothing similar"
        wrong.append(f"expected a {kind} of {topic} ({message}); {seen}")
    return wrong


def _absolute(judge: Judge, which: str, usual: Graph, names: Iterable[str]) -> list[str]:
    """Return in words the names that stay the same in a namespace, of those that the node has outside of one."""
    trial = judge.evidence.trials.get("launch_remapped")
    graph: Graph | None = getattr(trial, which, None)
    present = {endpoint.topic for endpoint in usual.endpoints} | {*usual.services, *usual.actions}
    return [
        f"in the namespace /{NAMESPACE} there is still /{name}: it is an absolute name, and {name!r} a relative one"
        for name in names
        if name in present and absolute(graph, name)
    ]


def _same_type(found: str, wanted: str) -> bool:
    if wanted.startswith(PACKAGE):
        return found.rpartition("/")[2] == wanted.rpartition("/")[2]
    return found == wanted


def _share(judge: Judge, wrong: list[str], count: int) -> None:
    if wrong:
        judge.share(1 - len(wrong) / count, "; ".join(wrong), _TRY)
