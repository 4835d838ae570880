"""`ros2 run`: start an executable of a package, and end as it ends."""

from __future__ import annotations

import argparse
import shlex
import signal
import subprocess
from typing import Any

from . import prefixes
from .answers import Refusal


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the words and flags."""
    parser.add_argument("--prefix", help="Prefix command, which should go before the executable, such as 'gdb --args'")
    package = parser.add_argument("package_name", help="Name of the ROS package")
    package.completer = complete_package  # type: ignore[attr-defined]  # read by argcomplete
    name = parser.add_argument("executable_name", help="Name of the executable")
    name.completer = complete_executable  # type: ignore[attr-defined]  # read by argcomplete
    parser.add_argument("argv", nargs=argparse.REMAINDER, help="Pass arbitrary arguments to the executable")
    parser.set_defaults(run=run)


def complete_package(prefix: str, **_: Any) -> list[str]:
    """Return the packages with executables that begin so."""
    names = prefixes.names("packages")
    return [name for name in names if name.startswith(prefix) and prefixes.executables(name)]


def complete_executable(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Return the package's executables that begin so."""
    found = prefixes.executables(parsed_args.package_name) or []
    return [path.name for path in found if path.name.startswith(prefix)]


def run(args: argparse.Namespace) -> int:
    """Run it; Ctrl-C reaches it from the terminal, and its exit code is ours."""
    found = prefixes.executables(args.package_name)
    if found is None:
        raise Refusal(f"Package '{args.package_name}' not found{prefixes.advice(args.package_name)}")
    paths = [path for path in found if path.name == args.executable_name]
    if not paths:
        there = ", ".join(path.name for path in found)
        raise Refusal("No executable found" + (f". {args.package_name} has {there}" if there else ""))
    if len(paths) > 1:
        raise Refusal("\n".join(["Multiple executables found:", *(f"- {path}" for path in paths)]))
    command = [*shlex.split(args.prefix or ""), str(paths[0]), *args.argv]
    # This process waits and passes nothing on but the end: a terminal's Ctrl-C goes to both of us.
    from ..launching.guard import die_with_parent  # noqa: TID252 - the two halves share this one safeguard

    # From before its start: one that comes between the start and the waiting would end us and leave it alone.
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)
    process = subprocess.Popen(command, preexec_fn=die_with_parent())
    signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    code = process.wait()
    if code != 0:
        said = signal.strsignal(-code) if code < 0 else f"Process exited with failure {code}"
        print(f"[ros2run]: {said}", flush=True)
    return code
