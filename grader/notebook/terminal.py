"""Print the shell lines that join a terminal to the workspace of the notebooks; grader/ros2/setup.bash runs them."""

from __future__ import annotations

import shlex
import sys

from grader import KIT
from grader.notebook.workspace import Workspace, discovery_range, find


def lines(workspace: Workspace, shell: str) -> list[str]:
    """Return lines for a shell ("bash", "zsh"): the notebooks' DDS domain, and the package as it was built last."""
    found = [
        f"export ROS_DOMAIN_ID={workspace.domain_id}",
        f"export ROS_AUTOMATIC_DISCOVERY_RANGE={discovery_range()}",
    ]
    # Not setup.bash: that one also sources the prefix of the wheels, which has no setup files.
    setup = workspace.root / "install" / f"local_setup.{shell}"
    return [*found, f". {shlex.quote(str(setup))}"] if setup.is_file() else found


if __name__ == "__main__":
    print("\n".join(lines(find(KIT), sys.argv[1])))
