# Prepare a terminal for ROS 2 from wheels, in bash or zsh. Where a tutorial says `source /opt/ros/jazzy/setup.bash`,
# source this file.
#
# It activates the kit's environment, and lets a plain `colcon build` find what it needs. The terminal hears the nodes
# of the notebooks, and knows the package in `ws` as it was built last.

_kit="$(cd "$(dirname "${BASH_SOURCE[0]:-${(%):-%x}}")/../.." && pwd)"
if [ ! -f "$_kit/.venv/bin/activate" ]; then
  echo "There is no environment yet. Type: make -C $_kit setup" >&2
  unset _kit
  return 1
fi
[ "${VIRTUAL_ENV:-}" = "$_kit/.venv" ] || . "$_kit/.venv/bin/activate"
export AMENT_PREFIX_PATH="$VIRTUAL_ENV" CMAKE_PREFIX_PATH="$VIRTUAL_ENV"
export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
export CMAKE_TOOLCHAIN_FILE="$_kit/grader/ros2/wheels.cmake"
export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"
export COLCON_LOG_LEVEL="${COLCON_LOG_LEVEL:-error}"  # it would warn of the wheels' prefix, which has no setup files
_shell=bash
if [ -n "${ZSH_VERSION:-}" ]; then
  _shell=zsh
  type compdef > /dev/null || { autoload -Uz compinit && compinit -u -D; }
fi
eval "$(register-python-argcomplete colcon)"
eval "$(python -P -c 'import sys; from grader.notebook import workspace; print(workspace.shell_lines(sys.argv[1]))' $_shell)"
unset _kit _shell
