#!/usr/bin/env bash
# Gradescope runs this once, as root and with a network, while it builds the image. Gradings need no network.
set -eu
kit=${ROS2_COURSE_KIT:-/opt/ros2-course-kit}
export DEBIAN_FRONTEND=noninteractive
apt-get update
# Ubuntu 22.04 has 3.10 as python3, and 3.11 beside it.
python=$(apt-cache show python3.12 >/dev/null 2>&1 && echo python3.12 || echo python3.11)
apt-get install -y --no-install-recommends \
    "$python" "$python-venv" "$python-dev" build-essential ccache proot bubblewrap util-linux
mkdir -p "$kit"
cp -r "$(dirname "$0")/kit/." "$kit"
cd "$kit"
make setup PYTHON="$python"
# A submission runs as another user: it needs Python and its packages, and nothing else of the kit.
for part in grader sim rubric.yaml course; do
    [ ! -e "$part" ] || chmod -R go-rwx "$part"
done
chmod 700 "$(dirname "$0")"
.venv/bin/grader doctor || true  # in the log of the build
# The first grading builds the contract's interfaces; do it now.
.venv/bin/python -c 'from pathlib import Path
from grader import building
from grader.course import find
building.build_contract(Path("cache"), find())'
