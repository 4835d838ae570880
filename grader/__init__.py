"""Grade a ROS 2 package: build it, run it in a sandbox, drive it through trials, score what was seen."""

from pathlib import Path

KIT = Path(__file__).resolve().parent.parent
"""The folder of the kit: grader, sim and rubric.yaml, and in a checkout solution_pkg, notebooks and docs."""
