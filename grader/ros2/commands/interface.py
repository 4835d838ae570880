"""`ros2 interface`: list the installed messages, services and actions, and show their definitions."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator

from . import arguments, messages, packages
from .packages import KINDS
from .refusals import Refusal, near

PRIMITIVES = {
    *("bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32"),
    *("int64", "uint64", "string", "wstring"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "interface")
    show = add_verb("show", "Output the interface definition", run_show)
    _add_type(show, "Show an interface definition (e.g. 'example_interfaces/msg/String'). '-' reads from stdin")
    show.add_argument("--all-comments", action="store_true", help="Show all comments, also of nested interfaces")
    show.add_argument("--no-comments", action="store_true", help="Show no comments or whitespace")
    _add_kinds(add_verb("list", "List all interface types available", run_list))
    package = add_verb("package", "Output a list of available interface types within one package", run_package)
    package.add_argument("package_name", help="Name of the package (e.g. 'example_interfaces')")
    _add_kinds(package)
    add_verb("packages", "Output a list of packages that provide interfaces", run_packages)
    proto = add_verb("proto", "Output an interface prototype", run_proto)
    _add_type(proto, "Show an interface prototype (e.g. 'example_interfaces/msg/String')")
    proto.add_argument("--no-quotes", action="store_true", help="If true output has no outer quotes.")


def _add_kinds(parser: argparse.ArgumentParser) -> None:
    for short, long, kind in (
        ("-m", "--only-msgs", "msg"),
        ("-s", "--only-srvs", "srv"),
        ("-a", "--only-actions", "action"),
    ):
        parser.add_argument(short, long, dest="only", action="append_const", const=kind, help=f"Only {KINDS[kind]}")


def _add_type(parser: argparse.ArgumentParser, text: str) -> None:
    def complete(prefix: str, **_: object) -> list[str]:
        return [name for name in packages.interfaces() if name.startswith(prefix)]

    arguments.add(parser, "type", complete, help=text)


def run_list(args: argparse.Namespace) -> int:
    """Print all interfaces."""
    for kind in args.only or KINDS:
        print(f"{KINDS[kind]}:")
        for name in packages.interfaces(kind):
            print(f"    {name}")
    return 0


def run_package(args: argparse.Namespace) -> int:
    """Print the interfaces of a package."""
    for name in packages.interfaces_of(args.package_name):
        if not args.only or name.split("/")[0] in args.only:
            print(f"{args.package_name}/{name}")
    return 0


def run_packages(_args: argparse.Namespace) -> int:
    """Print the packages that have interfaces."""
    print("\n".join(packages.names("rosidl_interfaces")))
    return 0


def run_show(args: argparse.Namespace) -> int:
    """Print a definition, with the definition of each field's type below the field."""
    name = sys.stdin.readline().strip() if args.type == "-" else args.type
    parts = name.split("/")
    if len(parts) != 3:
        same = [one for one in packages.interfaces() if one.split("/")[-1] == parts[-1]]
        raise Refusal(f"Invalid name '{name}'. Expected three parts separated by '/'{near(name, same)}")
    if parts[1] not in KINDS:
        raise Refusal(f"Invalid name '{name}'. The middle part is one of {', '.join(KINDS)}")
    comments = not args.no_comments
    for line in _lines(parts[0], parts[1], parts[2], comments, comments and args.all_comments, 0):
        print(line)
    return 0


def _lines(package: str, kind: str, name: str, comments: bool, inner_comments: bool, depth: int) -> Iterator[str]:
    for line in packages.definition(package, kind, name).read_text().splitlines():
        code = line.split("#", 1)[0].rstrip() if not _quoted_hash(line) else line.rstrip()
        if comments:
            yield "\t" * depth + line if line else ""
        elif code:
            yield "\t" * depth + code
        if code and (inner := nested(package, code)):
            yield from _lines(inner[0], "msg", inner[1], inner_comments, inner_comments, depth + 1)


def _quoted_hash(line: str) -> bool:
    return bool(re.search(r"[\"'][^\"']*#[^\"']*[\"']", line))


def nested(package: str, code: str) -> tuple[str, str] | None:
    """Return package and name of the message type of the field that a line declares, or None."""
    if code.strip() == "---":
        return None
    base = re.split(r"[\[<]", code.split()[0])[0]
    if base in PRIMITIVES or "=" in code.split()[0]:
        return None
    return (base.split("/")[0], base.split("/")[-1]) if "/" in base else (package, base)


def run_proto(args: argparse.Namespace) -> int:
    """Print all fields of an interface in the form in which values are given on a command line."""
    parts = args.type.split("/")
    kind = parts[1] if len(parts) == 3 and parts[1] in KINDS else "msg"
    quote = "" if args.no_quotes else '"'
    print(f"{quote}{messages.to_yaml(messages.prototype(args.type, kind))}{quote}")
    return 0
