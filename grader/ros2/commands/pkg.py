"""`ros2 pkg`: list the packages, show what they hold, and create one."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from . import arguments, packages, pkg_create
from .refusals import Refusal


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "pkg")
    pkg_create.add_arguments(add_verb("create", "Create a new ROS 2 package", pkg_create.run))
    add_verb("list", "Output a list of available packages", show_list)
    prefix = add_verb("prefix", "Output the prefix path of a package", show_prefix)
    _package(prefix)
    prefix.add_argument("--share", action="store_true", help="Show the share directory for the package")
    executables = add_verb("executables", "Output a list of package specific executables", show_executables)
    _package(executables, nargs="?")
    _package(add_verb("xml", "Output the XML of the package manifest", show_xml))


def _package(parser: argparse.ArgumentParser, **rest: Any) -> None:
    arguments.add(parser, "package_name", arguments.offer(packages.names), help="Name of the package", **rest)


def _prefix(package: str) -> Path:
    if (found := packages.prefix(package)) is None:
        raise Refusal(f"Package not found{packages.advice(package)}")
    return found


def show_list(_args: argparse.Namespace) -> int:
    """Print the packages."""
    print("\n".join(packages.names()))
    return 0


def show_prefix(args: argparse.Namespace) -> int:
    """Print where a package is installed."""
    found = _prefix(args.package_name)
    print(found / "share" / args.package_name if args.share else found)
    return 0


def show_executables(args: argparse.Namespace) -> int:
    """Print the executables of a package, or of all."""
    for package in [args.package_name] if args.package_name else packages.names():
        found = packages.executables(package)
        if found is None:
            raise Refusal(f"Package '{package}' not found{packages.advice(package)}")
        for path in found:
            print(f"{package} {path.name}")
    return 0


def show_xml(args: argparse.Namespace) -> int:
    """Print a package's manifest."""
    print((_prefix(args.package_name) / "share" / args.package_name / "package.xml").read_text())
    return 0
