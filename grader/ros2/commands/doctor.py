"""`ros2 doctor`: run the kit's own doctor; without the kit, print the environment."""

from __future__ import annotations

import argparse
import importlib
import os
import sys


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flag that tutorials use; it has no effect: the whole report is always printed."""
    parser.add_argument("--report", "-r", action="store_true", help="Print all reports.")
    parser.set_defaults(run=run)


def run(_args: argparse.Namespace) -> int:
    """Print the findings and return 0 if all is well."""
    try:
        doctor = importlib.import_module("grader.host.doctor")
    except ImportError:
        print(f"Python {sys.version.split()[0]} in {sys.prefix}")
        for name in ("AMENT_PREFIX_PATH", "ROS_DISTRO", "ROS_DOMAIN_ID", "RMW_IMPLEMENTATION"):
            print(f"{name}={os.environ.get(name, '')}")
        return 0
    findings = doctor.examine()
    print(doctor.render(findings))
    return int(doctor.exit_status(findings) != 0)
