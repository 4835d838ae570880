"""The `ros2` command: which words there are, and who answers them. Code is read only for the command asked for."""

from __future__ import annotations

import argparse
import sys

from . import environment


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    words = sys.argv[1:] if argv is None else argv
    environment.complete()
    parser = argparse.ArgumentParser(prog="ros2")
    commands = parser.add_subparsers(dest="command", metavar="Call `ros2 <command> -h` for more detailed usage.")
    from .launching import command, modules

    launch = commands.add_parser("launch", help="Run a launch file")
    command.add_arguments(launch)
    args = parser.parse_args(words)
    modules.install()
    return command.main(args)
