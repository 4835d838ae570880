"""The facts of the assignment, each in one place: names, interfaces, nodes, parameters and their defaults, layout."""

from __future__ import annotations

from pathlib import Path

PACKAGE = "ros2_robot_controller"


INTERFACES_PACKAGE = f"{PACKAGE}_interfaces"  # the name under which a submission may split its interfaces off


CONTRACT = Path(__file__).parent / PACKAGE


INTERFACES = ("srv/SetSpeed", "srv/GetRobotStatus", "action/NavigateToPosition", "msg/SensorFusionData")
