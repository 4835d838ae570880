# Prepare a terminal for ROS 2 from wheels. Where a tutorial says `source /opt/ros/jazzy/setup.bash`, source this file.
#
# It activates the kit's environment, lets a plain `colcon build` find what it needs, and completes names with Tab.

_kit="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
if [ -z "$VIRTUAL_ENV" ] && [ -f "$_kit/.venv/bin/activate" ]; then
  . "$_kit/.venv/bin/activate"
fi
if [ -z "$VIRTUAL_ENV" ]; then
  echo "There is no environment yet. Type: make -C $_kit setup" >&2
else
  export AMENT_PREFIX_PATH="$VIRTUAL_ENV" CMAKE_PREFIX_PATH="$VIRTUAL_ENV"
  export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
  export CMAKE_TOOLCHAIN_FILE="$_kit/grader/ros2/wheels.cmake"
  export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"
  export COLCON_LOG_LEVEL="${COLCON_LOG_LEVEL:-error}"  # it would warn of the wheels' prefix, which has no setup files
  eval "$("$VIRTUAL_ENV/bin/register-python-argcomplete" ros2)"
  eval "$("$VIRTUAL_ENV/bin/register-python-argcomplete" colcon)"
fi
unset _kit
