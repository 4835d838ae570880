"""The `ros2` command line. Only the module of the command asked for is imported."""

from __future__ import annotations

import argparse
import importlib
import os
import re
import signal
import sys
from collections.abc import Callable
from typing import NoReturn

from .commands import Refusal, near

COMMANDS = {
    "action": "Various action related sub-commands",
    "bag": "Various rosbag related sub-commands",
    "interface": "Show information about ROS interfaces",
    "launch": "Run a launch file",
    "node": "Various node related sub-commands",
    "param": "Various param related sub-commands",
    "pkg": "Various package related sub-commands",
    "run": "Run a package specific executable",
    "service": "Various service related sub-commands",
    "topic": "Various topic related sub-commands",
}
# Commands and verbs of the real one that this one lacks, and what to use instead.
ABSENT = {
    "component": "composable nodes are not supported by this kit",
    "control": "ros2_control cannot be installed with pip",
    "daemon": "there is no daemon: each command waits for discovery itself",
    "doctor": "type `make doctor` in the folder of the course kit",
    "lifecycle": "lifecycle nodes are not supported by this kit",
    "multicast": "type `make doctor` in the folder of the course kit",
    "security": "SROS 2 is not supported by this kit",
    "wtf": "type `make doctor` in the folder of the course kit",
    "action type": "use `ros2 action list -t`",
    "interface list": "use `ros2 interface package PACKAGE`",
    "interface packages": "use `ros2 pkg list`, then `ros2 interface package PACKAGE`",
    "param delete": "set another value with `ros2 param set`, or start the node again",
    "service echo": "use `ros2 service call`",
    "service info": "use `ros2 service type`, and `ros2 node info` for who offers it",
    "topic bw": "use `ros2 topic hz`",
    "topic find": "use `ros2 topic list -t`",
    "topic type": "use `ros2 topic info`",
}
MORE = "Call `ros2 <command> -h` for more detailed usage."


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # while there is nothing to tidy up, Ctrl-C just ends the process
    words = sys.argv[1:] if argv is None else argv
    complete_environment()
    name = next((word for word in words if not word.startswith("-")), None)
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(line_buffering=True)  # so that a pipe gets each message at once
    parser = _parser(name)
    spoken = " ".join(word for word in words if not word.startswith("-")) + " "
    for absent, instead in ABSENT.items():
        if spoken.startswith(f"{absent} "):
            parser.exit(2, f"ros2 {absent}: not available; {instead}\n")
    args, unknown = parser.parse_known_args(words)
    if unknown:
        tip = '\nValues go in quotes, as one word: "{speed: 0.2}"' if hasattr(args, "values") else ""
        parser.error(f"unrecognized arguments: {' '.join(unknown)}{tip}")
    if name is None:
        parser.print_help()
        return 0
    chosen: Callable[[argparse.Namespace], int | None] | None = getattr(args, "run", None)
    if chosen is None:  # `ros2 topic` alone
        parser.parse_args([*words, "-h"])
        return 0
    return _run(chosen, args)


class Parser(argparse.ArgumentParser):
    """A parser that suggests the word that was probably meant."""

    def error(self, message: str) -> NoReturn:
        """Print what is wrong, and exit."""
        if found := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message):
            message += near(found[1], re.findall(r"[\w-]+", found[2]))
        super().error(message)


def _run(chosen: Callable[[argparse.Namespace], int | None], args: argparse.Namespace) -> int:
    interrupted = False

    def interrupt(*_: object) -> None:
        nonlocal interrupted
        interrupted = True
        raise KeyboardInterrupt

    # Also where SIGINT is ignored, as behind an `&` in a script: rclpy sets a handler there too.
    signal.signal(signal.SIGINT, interrupt)
    try:
        code = chosen(args) or 0
        sys.stdout.flush()
    except Refusal as refusal:
        print(refusal, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 2
    except RuntimeError:
        if not interrupted:
            raise
        return 2  # Ctrl-C in the middle of rclpy's C++, which turns it into an error of its own
    except BrokenPipeError:  # `ros2 topic list | head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def _parser(name: str | None) -> argparse.ArgumentParser:
    parser = Parser(
        prog="ros2",
        description="ros2 of the ROS 2 course kit: the commands of the real one, on Python wheels alone.",
        epilog="Example: ros2 topic echo --once /odom",
    )
    commands = parser.add_subparsers(title="Commands", metavar=MORE)
    for command, text in COMMANDS.items():
        below = commands.add_parser(command, help=text)
        if command == name:
            module = ".launching.command" if command == "launch" else f".commands.{command}"
            importlib.import_module(module, __package__).add_arguments(below)
    return parser


def complete_environment() -> None:
    """Fill in the variables that are missing in a terminal which is not prepared."""
    prefixes = [part for part in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if part]
    os.environ["AMENT_PREFIX_PATH"] = os.pathsep.join(dict.fromkeys([*prefixes, sys.prefix]))
    for name, value in (("ROS_DISTRO", "jazzy"), ("ROS_VERSION", "2"), ("ROS_PYTHON_VERSION", "3")):
        os.environ.setdefault(name, value)
