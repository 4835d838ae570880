"""`ros2 pkg`: what packages there are, what they hold, and making one."""

from __future__ import annotations

import argparse
from typing import Any

from . import pkg_create, prefixes
from .answers import Refusal


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the words and flags."""
    verbs = parser.add_subparsers(title="Commands", metavar="Call `ros2 pkg <command> -h` for more detailed usage.")
    pkg_create.add_verb(verbs)
    listing = verbs.add_parser("list", help="Output a list of available packages")
    listing.set_defaults(run=show_list)
    prefix = verbs.add_parser("prefix", help="Output the prefix path of a package")
    _package(prefix)
    prefix.add_argument("--share", action="store_true", help="Show the share directory for the package")
    prefix.set_defaults(run=show_prefix)
    executables = verbs.add_parser("executables", help="Output a list of package specific executables")
    _package(executables, nargs="?")
    executables.add_argument("--full-path", action="store_true", help="Show the full path of each executable")
    executables.set_defaults(run=show_executables)
    xml = verbs.add_parser("xml", help="Output the XML of the package manifest or a specific tag")
    _package(xml)
    xml.add_argument("-t", "--tag", help="The XML tag to output, e.g. version")
    xml.set_defaults(run=show_xml)


def _package(parser: argparse.ArgumentParser, **rest: Any) -> None:
    argument = parser.add_argument("package_name", help="Name of the package", **rest)
    argument.completer = lambda prefix, **_: [n for n in prefixes.names("packages") if n.startswith(prefix)]  # type: ignore[attr-defined]


def show_list(_args: argparse.Namespace) -> int:
    """Print the packages."""
    for name in prefixes.names("packages"):
        print(name)
    return 0


def show_prefix(args: argparse.Namespace) -> int:
    """Print where a package is installed."""
    found = prefixes.prefix(args.package_name)
    if found is None:
        raise Refusal(f"Package not found{prefixes.advice(args.package_name)}")
    print(found / "share" / args.package_name if args.share else found)
    return 0


def show_executables(args: argparse.Namespace) -> int:
    """Print the executables of a package, or of all."""
    for package in [args.package_name] if args.package_name else prefixes.names("packages"):
        found = prefixes.executables(package)
        if found is None:
            raise Refusal(f"Package '{package}' not found{prefixes.advice(package)}")
        for path in found:
            print(path if args.full_path else f"{package} {path.name}")
    return 0


def show_xml(args: argparse.Namespace) -> int:
    """Print a package's manifest, or the values of one tag."""
    import xml.etree.ElementTree as ET

    found = prefixes.prefix(args.package_name)
    if found is None:
        raise Refusal(f"Package not found{prefixes.advice(args.package_name)}")
    text = (found / "share" / args.package_name / "package.xml").read_text()
    if args.tag is None:
        print(text)
        return 0
    values = [element.text or "" for element in ET.fromstring(text).findall(args.tag)]
    if not values:
        raise Refusal(f"No value found for tag '{args.tag}'")
    print("\n".join(values))
    return 0
