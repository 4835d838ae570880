"""`ros2 run`: start an executable of a package, and return its exit code."""

from __future__ import annotations

import argparse
import signal
import subprocess

from . import Refusal, die_with_parent, packages


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare arguments and flags."""
    parser.add_argument("package_name", help="Name of the ROS package")
    parser.add_argument("executable_name", help="Name of the executable")
    parser.add_argument("argv", nargs=argparse.REMAINDER, help="Pass arbitrary arguments to the executable")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the executable and return its exit code; Ctrl-C reaches it from the terminal."""
    found = packages.executables(args.package_name)
    paths = [path for path in found if path.name == args.executable_name]
    if not paths:
        there = ", ".join(path.name for path in found)
        raise Refusal("No executable found" + (f". {args.package_name} has {there}" if there else ""))
    if len(paths) > 1:
        raise Refusal("\n".join(["Multiple executables found:", *(f"- {path}" for path in paths)]))
    # A terminal's Ctrl-C goes to both processes; this one waits for the other, and passes on nothing but SIGTERM.
    # Set before the start: Ctrl-C between the start and the wait would end this process and leave the other running.
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)
    process = subprocess.Popen([str(paths[0]), *args.argv], preexec_fn=die_with_parent())
    signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    code = process.wait()
    if code != 0:
        said = signal.strsignal(-code) if code < 0 else f"Process exited with failure {code}"
        print(f"[ros2run]: {said}", flush=True)
    return code
