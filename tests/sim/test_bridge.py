"""The bridge: a node in lockstep with the simulator, in its own network namespace."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from helpers import beside
from helpers.node_runs import run_with_node

TEXTS = beside(__file__)

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]


def run(tmp_path: Path, kind: str, ticks: int = 40, event: str = "none") -> dict[str, Any]:
    (tmp_path / "node.py").write_text(TEXTS["NODE"])
    (tmp_path / "host.py").write_text(TEXTS["HOST"])
    answer = run_with_node(tmp_path / "host.py", tmp_path / "node.py", kind, event, str(ticks))
    assert answer["ready"]
    return answer


def test_a_node_on_the_clock_is_in_lockstep_and_two_runs_give_the_same_commands(tmp_path: Path):
    found, again = run(tmp_path, "timer"), run(tmp_path, "timer")
    assert (found["pace"], found["said"]) == ("lockstep", ["", ""])
    later = [(t, n) for t, _, n in found["commands"] if t > 0.15]
    assert [t for t, _ in later] == pytest.approx([0.2 + 0.1 * i for i in range(19)]), "at its own rate"
    # Each command carries the number of scans received so far: ten scans a second, ten commands a second.
    assert all(n == pytest.approx(10 * t, abs=1.01) for t, n in later), "based on the scan of its own tick"
    assert found["x"] != 0.0, "the robot follows"
    # Two rounds per tick, a third if a clock message got lost; the five IMU readings in each are not published.
    assert 80 <= found["calls"] < 120
    assert [c for c in found["commands"] if c[0] > 0] == [c for c in again["commands"] if c[0] > 0]


@pytest.mark.slow  # one more node
def test_a_node_that_publishes_best_effort_is_heard_as_well(tmp_path: Path):
    """Its robot stood still: a reliable subscription receives nothing from such a publisher."""
    found = run(tmp_path, "best effort")
    assert found["pace"] == "lockstep"
    later = [t for t, _, _ in found["commands"] if t > 0.15]
    assert later == pytest.approx([0.2 + 0.1 * i for i in range(19)])


@pytest.mark.slow  # a node more
def test_what_a_late_answer_brings_with_it_counts_for_the_same_tick(tmp_path: Path):
    """One fused message of eighty was recorded a tick late, where the answer came after the barrier."""
    found = run(tmp_path, "own thread")
    assert len(found["seconds"]) > 10
    assert found["seconds"] == [t for t, _, _ in found["commands"]]


@pytest.mark.slow  # a node more
def test_a_message_is_served_in_its_tick_down_to_the_last_callback(tmp_path: Path):
    """Without it, an action's result counted for the next tick if it and the end of its tick arrived together."""
    told = run(tmp_path, "timer", event="late")["told"]
    assert len(told) > 15
    assert [served for _, served in told] == [came for came, _ in told]


@pytest.mark.slow  # waits in real time
def test_a_node_on_wall_time_is_detected_and_run_in_real_time(tmp_path: Path):
    found = run(tmp_path, "wall")
    if found["pace"] == "lockstep" and found["tick_s"] > 0.02:
        pytest.skip(f"a tick took {found['tick_s']} s: repeat the test on a less busy machine")
    assert found["pace"] == "real time"
    assert found["t"] == pytest.approx(2.0)


@pytest.mark.slow  # waits in real time
def test_a_node_on_wall_time_that_speaks_only_after_a_scan_is_detected_when_that_has_come(tmp_path: Path):
    """It was asked how it keeps time before the first scan, when it had nothing to say, and never again."""
    found = run(tmp_path, "wall after a scan", ticks=27, event="scans later")
    assert found["pace"] == "real time"


@pytest.mark.slow  # a node for each reason
@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        # On a busy machine one cause may be taken for another; either is a fair warning.
        ("after its answer", "came after the node had said that it was done|real time"),
        ("wall", "the node runs on wall time and was run in real time|timing by wall time"),
        ("no services", "the node has no parameter services|real time"),
    ],
)
def test_a_recording_says_why_another_run_may_differ(tmp_path: Path, kind: str, reason: str):
    # In the pause what comes 5 ms after the node's answer arrives before the next tick, on a busy machine too.
    event = "pause" if kind == "after its answer" else "none"
    simulator_says, recording_says = run(tmp_path, kind, ticks=100, event=event)["said"]  # type: ignore[misc]
    assert re.search(reason, simulator_says)
    assert recording_says == simulator_says


@pytest.mark.slow  # waits for what does not come
def test_a_dead_node_holds_up_nothing(tmp_path: Path):
    found = run(tmp_path, "timer", ticks=200, event="kill")
    assert found["said"] == ["", ""]
    assert found["t"] == pytest.approx(10.0)


@pytest.mark.slow  # waits for a node that is blocked on purpose
def test_a_blocked_node_holds_up_the_run_once(tmp_path: Path):
    found = run(tmp_path, "blocked", ticks=20)
    assert "busy in a callback for seconds of wall time" in found["said"][0]
    assert found["blocked"] is True
    assert found["t"] == pytest.approx(1.0)


@pytest.mark.slow  # a node more
def test_all_that_a_node_publishes_is_heard_from_the_match_to_the_end(tmp_path: Path):
    """The node is stopped while the subscription is made, and the last message comes just before the end."""
    (tmp_path / "node.py").write_text(TEXTS["GREETER"])
    (tmp_path / "host.py").write_text(TEXTS["LISTENER"])
    found = run_with_node(tmp_path / "host.py", tmp_path / "node.py")
    assert found == {"matched": True, "heard": list(range(50)), "early": True}


@pytest.mark.slow  # a node more
def test_a_tick_in_real_time_serves_what_has_arrived_even_if_it_is_late(tmp_path: Path):
    """On a busy machine feedback lay in the queue for a second, and its distance was called wrong."""
    (tmp_path / "node.py").write_text(TEXTS["SPEAKER"])
    (tmp_path / "host.py").write_text(TEXTS["LATE"])
    found = run_with_node(tmp_path / "host.py", tmp_path / "node.py", tmp_path / "said")
    assert found == {"before": 0, "heard": list(range(50))}
