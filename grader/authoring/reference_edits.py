"""Edits that make an earlier stage of a file out of the reference's.

They quote the solutions, so a students' kit has none of them.
"""

from __future__ import annotations

from dataclasses import dataclass

from grader.errors import GraderError


@dataclass(frozen=True)
class Edit:
    """A change of a reference's file that makes an earlier stage of it: `old` stands in it once."""

    why: str
    old: str
    new: str

    def apply(self, text: str) -> str:
        """Return the text with the change made.

        Raises:
            GraderError: the reference has moved on, and the edit with it has not.
        """
        if text.count(self.old) != 1:
            raise GraderError(f"The stage edit {self.why!r} fits the reference {text.count(self.old)} times, not once.")
        return text.replace(self.old, self.new)


_NO_INTERFACES_YET = (
    Edit(
        "no interfaces yet",
        """\
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(std_msgs REQUIRED)

# 1. The interfaces: rosidl turns these into Python (and C, C++) types.
rosidl_generate_interfaces(${PROJECT_NAME}
  "msg/SensorFusionData.msg"
  "srv/SetSpeed.srv"
  "srv/GetRobotStatus.srv"
  "action/NavigateToPosition.action"
  DEPENDENCIES geometry_msgs std_msgs
)

# 2. Our Python modules, laid over the generated ones.
#    ament_python_install_package() cannot be used here: rosidl already owns a target of this name.
""",
        """\
find_package(ament_cmake REQUIRED)

# 1. The interfaces come here, when there are some.

# 2. Our Python modules.
""",
    ),
)
_ONLY_RCLPY_YET = (
    Edit("no generators yet", "  <buildtool_depend>rosidl_default_generators</buildtool_depend>\n", ""),
    Edit("no messages yet", "  <depend>geometry_msgs</depend>\n  <depend>std_msgs</depend>\n\n", ""),
    Edit(
        "no interfaces, no launch files yet",
        """\
  <exec_depend>action_msgs</exec_depend>
  <exec_depend>ament_index_python</exec_depend>
  <exec_depend>launch</exec_depend>
  <exec_depend>launch_ros</exec_depend>
  <exec_depend>nav_msgs</exec_depend>
  <exec_depend>rcl_interfaces</exec_depend>
  <exec_depend>rclpy</exec_depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <exec_depend>sensor_msgs</exec_depend>
""",
        "  <exec_depend>rclpy</exec_depend>\n",
    ),
    Edit("no interfaces yet", "  <member_of_group>rosidl_interface_packages</member_of_group>\n\n", ""),
)

_DRAFTS = {"no interfaces yet": _NO_INTERFACES_YET, "only rclpy yet": _ONLY_RCLPY_YET}


def apply(draft: str, text: str) -> str:
    """Return a reference's text as it is at an earlier stage.

    Raises:
        GraderError: the reference has moved on, and the edits with it have not.
    """
    for edit in _DRAFTS[draft]:
        text = edit.apply(text)
    return text
