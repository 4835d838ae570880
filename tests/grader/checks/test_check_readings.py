"""F6: a robot to which no reading comes has not coped with bad ones."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import recordings
from helpers.judging import Judged, ask, find

from grader.evidence import Command, Graph

CHECKS = (
    "test_bad_readings_are_not_an_obstacle",
    "test_bad_readings_do_not_crash_the_node",
    "test_a_real_obstacle_among_bad_readings_is_seen",
)


def without_a_subscription(check: str, *, drives_on: bool) -> Judged:
    """Return what a check says of the reference when the graph shows no subscription to scan."""
    evidence = recordings.load("reference")
    trials = dict(evidence.trials)
    for name in ("bad_readings", "empty_scans", "obstacle_among_bad_readings"):
        graph = trials[name].graph or Graph()
        trials[name] = replace(
            trials[name],
            graph=replace(graph, endpoints=[e for e in graph.endpoints if e.topic != "scan"]),
            commands=[Command(c.t, 0.25, 0.0) if drives_on else c for c in trials[name].commands],
        )
    return ask(find(f"check_readings::{check}"), replace(evidence, trials=trials))


@pytest.mark.parametrize("check", CHECKS)
def test_a_controller_that_does_not_subscribe_to_the_scan_has_survived_nothing(check: str):
    answer = without_a_subscription(check, drives_on=True)
    assert not answer.reached
    assert "does not subscribe to scan" in answer.seen


@pytest.mark.parametrize("check", CHECKS)
def test_a_controller_that_stops_for_an_obstacle_gets_scans_whoever_subscribes(check: str):
    assert without_a_subscription(check, drives_on=False).share == 1
