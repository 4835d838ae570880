"""I5: a remapping in a launch file."""

from grader.checks.judge import Judge, NotReached
from grader.checks.wording import NAMESPACE, absolute
from grader.words import mark, say

NEEDS = ("idle",)


def test_a_remapping_in_a_launch_file_works(judge: Judge) -> None:
    """A remapping given in the launch file works."""
    # I4 judges a name that the node does not have without a launch file either.
    usual = {
        name: {endpoint.topic for endpoint in judge.graph(name).endpoints}
        for name in ("idle_robot_controller", "idle_sensor_processor")
    }
    trial = judge.trial("launch_remapped")
    tried = 0
    for graph, without, moved in (
        (trial.graph, "idle_robot_controller", {"cmd_vel": "base/cmd_vel", "scan": "front/scan"}),
        (trial.other_graph, "idle_sensor_processor", {"raw_scan": "front/scan", "obstacle_distance": "front/distance"}),
    ):
        topics = {endpoint.topic.removeprefix(f"{NAMESPACE}/") for endpoint in graph.endpoints} if graph else set()
        for old, new in moved.items():
            if old not in usual[without]:
                continue
            tried += 1
            still = say("has neither")
            if old in topics:
                still = say("still has {name}", name=f"/{old}" if absolute(graph, old) else old)
            words = mark("in the namespace /{ns}, with {old} remapped to {new}, the node {still}")
            seen = say(words, ns=NAMESPACE, old=old, new=new, still=still)
            judge.expect(new in topics, seen, say("use relative names: 'scan', not '/scan'"))
    if not tried:
        raise NotReached(say("the nodes have none of the topics that would be remapped"), "I4")
