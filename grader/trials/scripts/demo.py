"""The trial of the package's own demonstration script."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage

_LIMIT_S = 60.0  # the robot crosses its world in less


# The service calls go through the observer: otherwise it could not see them and would have to believe the script.
@trial(
    serves=["Q6"],
    world="open_field",  # the script may drive anywhere
    beside={"sensor_processor": {"raw_scan": "scan"}},
    remappings={"set_speed": "behind/set_speed", "get_status": "behind/get_status"},
    real_time=True,
)
def demo(stage: Stage) -> None:
    """Run the package's demonstration script against both nodes, in real time."""
    stage.proxy_services(["set_speed", "get_status"])
    stage.watch_goals()
    stage.run(0.5)
    script = stage.run_script("scripts/demo.py")
    stage.run_until(lambda: script.exit_code() is not None, _LIMIT_S)
    stage.run(0.2)
