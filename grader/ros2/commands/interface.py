"""`ros2 interface`: what messages, services and actions are installed, and what is in them."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from . import hints, messages, prefixes
from .answers import Refusal

KINDS = {"msg": "Messages", "srv": "Services", "action": "Actions"}
PRIMITIVES = {
    *("bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32"),
    *("int64", "uint64", "string", "wstring"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the words and flags."""
    verbs = parser.add_subparsers(
        title="Commands", metavar="Call `ros2 interface <command> -h` for more detailed usage."
    )
    show = verbs.add_parser("show", help="Output the interface definition")
    type_argument(show, "Show an interface definition (e.g. 'example_interfaces/msg/String'). '-' reads from stdin")
    show.add_argument("--all-comments", action="store_true", help="Show all comments, also of nested interfaces")
    show.add_argument("--no-comments", action="store_true", help="Show no comments or whitespace")
    show.set_defaults(run=run_show)
    listing = verbs.add_parser("list", help="List all interface types available")
    _add_kinds(listing)
    listing.set_defaults(run=run_list)
    package = verbs.add_parser("package", help="Output a list of available interface types within one package")
    package.add_argument("package_name", help="Name of the package (e.g. 'example_interfaces')")
    _add_kinds(package)
    package.set_defaults(run=run_package)
    packages = verbs.add_parser("packages", help="Output a list of packages that provide interfaces")
    packages.set_defaults(run=run_packages)
    proto = verbs.add_parser("proto", help="Output an interface prototype")
    type_argument(proto, "Show an interface prototype (e.g. 'example_interfaces/msg/String')")
    proto.add_argument("--no-quotes", action="store_true", help="If true output has no outer quotes.")
    proto.set_defaults(run=run_proto)


def _add_kinds(parser: argparse.ArgumentParser) -> None:
    for short, long, kind in (
        ("-m", "--only-msgs", "msg"),
        ("-s", "--only-srvs", "srv"),
        ("-a", "--only-actions", "action"),
    ):
        parser.add_argument(short, long, dest="only", action="append_const", const=kind, help=f"Only {KINDS[kind]}")


def type_argument(parser: argparse.ArgumentParser, text: str) -> None:
    """Declare the name of an interface, which the shell completes."""
    argument = parser.add_argument("type", help=text)
    argument.completer = lambda prefix, **_: [n for n in every() if n.startswith(prefix)]  # type: ignore[attr-defined]


def of_package(package: str) -> list[str]:
    """Return the interfaces of a package as `kind/Name`, in the order of its list."""
    listed = prefixes.resource("rosidl_interfaces", package)
    if listed is None:
        raise Refusal(f"Unknown package '{package}'")
    files = [line.strip() for line in listed.read_text().splitlines()]
    return [name for name, ending in (line.rsplit(".", 1) for line in files if "." in line) if ending in KINDS]


def every(*kinds: str) -> list[str]:
    """Return all interfaces as `package/kind/Name`."""
    names = (f"{package}/{name}" for package in prefixes.names("rosidl_interfaces") for name in of_package(package))
    return sorted(name for name in names if not kinds or name.split("/")[1] in kinds)


def run_list(args: argparse.Namespace) -> int:
    """Print all interfaces."""
    for kind in args.only or KINDS:
        print(f"{KINDS[kind]}:")
        for name in every(kind):
            print(f"    {name}")
    return 0


def run_package(args: argparse.Namespace) -> int:
    """Print the interfaces of a package."""
    for name in of_package(args.package_name):
        if not args.only or name.split("/")[0] in args.only:
            print(f"{args.package_name}/{name}")
    return 0


def run_packages(_args: argparse.Namespace) -> int:
    """Print the packages that have interfaces."""
    for name in prefixes.names("rosidl_interfaces"):
        print(name)
    return 0


def definition(package: str, kind: str, name: str) -> Path:
    """Return the file that defines an interface."""
    prefix = prefixes.prefix(package)
    if prefix is None:
        raise Refusal(f"Unknown package '{package}'{hints.near(package, prefixes.names('rosidl_interfaces'))}")
    path = prefix / "share" / package / kind / f"{name}.{kind}"
    if not path.is_file():
        near = hints.near(f"{package}/{kind}/{name}", every(kind))
        raise Refusal(f"Could not find the interface '{path}'{near}")
    return path


def run_show(args: argparse.Namespace) -> int:
    """Print a definition, with what is inside each field's type below it."""
    name = sys.stdin.readline().strip() if args.type == "-" else args.type
    parts = name.split("/")
    if len(parts) != 3:
        near = hints.near(name, [one for one in every() if one.split("/")[-1] == parts[-1]])
        raise Refusal(f"Invalid name '{name}'. Expected three parts separated by '/'{near}")
    if parts[1] not in KINDS:
        raise Refusal(f"Invalid name '{name}'. The middle part is one of {', '.join(KINDS)}")
    comments = not args.no_comments
    for line in _lines(parts[0], parts[1], parts[2], comments, comments and args.all_comments, 0):
        print(line)
    return 0


def _lines(package: str, kind: str, name: str, comments: bool, inner_comments: bool, depth: int) -> Iterator[str]:
    for line in definition(package, kind, name).read_text().splitlines():
        code = line.split("#", 1)[0].rstrip() if not _quoted_hash(line) else line.rstrip()
        if comments:
            yield "\t" * depth + line if line else ""
        elif code:
            yield "\t" * depth + code
        if code and (inner := _nested(package, code)):
            yield from _lines(inner[0], "msg", inner[1], inner_comments, inner_comments, depth + 1)


def _quoted_hash(line: str) -> bool:
    return bool(re.search(r"[\"'][^\"']*#[^\"']*[\"']", line))


def _nested(package: str, code: str) -> tuple[str, str] | None:
    """Return package and name of the message that a line's field holds, if it holds one."""
    if code.strip() == "---":
        return None
    base = re.split(r"[\[<]", code.split()[0])[0]
    if base in PRIMITIVES or "=" in code.split()[0]:
        return None
    return (base.split("/")[0], base.split("/")[-1]) if "/" in base else (package, base)


def run_proto(args: argparse.Namespace) -> int:
    """Print what can be given as values on a command line."""
    parts = args.type.split("/")
    kind = parts[1] if len(parts) == 3 and parts[1] in KINDS else "msg"
    made = messages.load(args.type, kind)
    value: Any = made() if kind == "msg" else (made.Request() if kind == "srv" else made.Goal())
    quote = "" if args.no_quotes else '"'
    print(f"{quote}{messages.to_yaml(value)}{quote}")
    return 0
