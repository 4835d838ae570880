"""The contract's interface types, for the observer. They come from the contract's own build, never a submission's.

Importable only in the process of grader/trials/host.py, whose path is set to that build.
"""

from ros2_robot_controller.action import NavigateToPosition  # noqa: TID251  the contract's build, see above
from ros2_robot_controller.msg import SensorFusionData  # noqa: TID251
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed  # noqa: TID251

SERVICES = {"set_speed": SetSpeed, "get_status": GetRobotStatus}

__all__ = ["SERVICES", "GetRobotStatus", "NavigateToPosition", "SensorFusionData", "SetSpeed"]
