"""What the running graph shows."""

from grader.checks.graph import expect_interfaces
from grader.checks.judge import Judge
from grader.evidence import Kind, Reason
from grader.words import say

NEEDS = ("idle",)


def test_nodes_show_the_contracts_interfaces(judge: Judge) -> None:
    """The running graph shows each node with the contract's topics, types, services and actions."""
    expect_interfaces(judge, judge.course.nodes.values())


def test_sensor_subscriptions_match_best_effort(judge: Judge) -> None:
    """Sensor subscriptions also match best-effort publishers, as real drivers use."""
    reliable = []
    for node in judge.course.nodes.values():
        for endpoint in judge.graph(f"idle_{node.name}").endpoints:
            known = endpoint.topic in {**node.subscribes, **node.publishes}
            if endpoint.kind == "subscription" and known and endpoint.reliability == "reliable":
                reliable.append(endpoint.topic)
    seen = say(
        "these subscriptions receive nothing from best-effort publishers: {reliable}", reliable=", ".join(reliable)
    )
    judge.expect(not reliable, seen, say("subscribe with qos_profile_sensor_data"), Reason(Kind.UNHEARD))
