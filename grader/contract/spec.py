"""The facts of the assignment, each in one place: names, interfaces, nodes, parameters with their defaults."""

from __future__ import annotations

from pathlib import Path

PACKAGE = "ros2_robot_controller"
INTERFACES_PACKAGE = f"{PACKAGE}_interfaces"  # a submission may split its interfaces off under this name

CONTRACT = Path(__file__).parent / PACKAGE
"""A package that holds the contract's interface files and nothing else."""

INTERFACES = ("srv/SetSpeed", "srv/GetRobotStatus", "action/NavigateToPosition", "msg/SensorFusionData")

HULL_RADIUS_M = 0.171
"""The radius of the grader's robot."""

NODES = ("robot_controller", "sensor_processor")
"""The nodes, and their executables."""

TOPICS = (
    "cmd_vel", "scan", "odom", "set_speed", "get_status", "navigate_to_position", "raw_scan", "imu/data",
    "battery/state", "sensor_fusion_data", "obstacle_distance",
)  # fmt: skip
"""The topics, services and the action of both nodes."""

NODE_MODULES = (f"{PACKAGE}/robot_controller.py", f"{PACKAGE}/sensor_processor.py")
CONVERSIONS_MODULE = f"{PACKAGE}/utils/conversions.py"
LAUNCH_FILES = ("launch/robot_controller_launch.py", "launch/sensor_processor_launch.py")
NODE_TESTS = ("test/test_robot_controller.py", "test/test_sensor_processor.py")
"""Files of the contract's layout, one for each node, and their place in the package."""

CONVERSIONS = ("yaw_from_quaternion", "quaternion_from_yaw", "normalize_angle", "clamp")
"""The functions of CONVERSIONS_MODULE."""

PARAMETERS: dict[str, dict[str, float]] = {
    "robot_controller": {
        "max_linear_speed": 0.5,
        "max_angular_speed": 1.0,
        "linear_acceleration": 1.0,
        "angular_acceleration": 2.0,
        "laser_processing_rate": 10.0,
        "fusion_rate": 20.0,
        "obstacle_detection_threshold": 0.5,
        "emergency_stop_distance": 0.2,
        "safety_margin": 0.3,
    },
    "sensor_processor": {
        "fusion_frequency": 20.0,
        "battery_low_threshold": 20.0,
        "battery_critical_threshold": 10.0,
    },
}
"""The numeric parameters of each node with their defaults, in SI units; battery thresholds in percent."""
