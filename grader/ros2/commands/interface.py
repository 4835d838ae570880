"""`ros2 interface`: list the installed messages, services and actions, and show their definitions."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator

from . import Refusal, arguments, messages, near, packages
from .packages import KINDS

PRIMITIVES = {
    *("bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32"),
    *("int64", "uint64", "string", "wstring"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "interface")
    show = add_verb("show", "Output the interface definition", run_show)
    show.add_argument("type", help="Show an interface definition (e.g. 'example_interfaces/msg/String')")
    package = add_verb("package", "Output a list of available interface types within one package", run_package)
    package.add_argument("package_name", help="Name of the package (e.g. 'example_interfaces')")
    proto = add_verb("proto", "Output an interface prototype", run_proto)
    proto.add_argument("type", help="Show an interface prototype (e.g. 'example_interfaces/msg/String')")


def run_package(args: argparse.Namespace) -> None:
    """Print the interfaces of a package."""
    for name in packages.interfaces_of(args.package_name):
        print(f"{args.package_name}/{name}")


def run_show(args: argparse.Namespace) -> None:
    """Print a definition, with the definition of each field's type below the field."""
    name, parts = args.type, args.type.split("/")
    if len(parts) != 3:
        same = [one for one in packages.interfaces() if one.split("/")[-1] == parts[-1]]
        raise Refusal(f"Invalid name '{name}'. Expected three parts separated by '/'{near(name, same)}")
    if parts[1] not in KINDS:
        raise Refusal(f"Invalid name '{name}'. The middle part is one of {', '.join(KINDS)}")
    for line in _lines(parts[0], parts[1], parts[2], 0):
        print(line)


def _lines(package: str, kind: str, name: str, depth: int) -> Iterator[str]:
    """Yield the lines of a definition and of those of its fields' types; of the latter without comments."""
    for line in packages.definition(package, kind, name).read_text().splitlines():
        quoted_hash = re.search(r"[\"'][^\"']*#[^\"']*[\"']", line)
        code = (line if quoted_hash else line.split("#", 1)[0]).rstrip()
        if depth == 0:
            yield line
        elif code:
            yield "\t" * depth + code
        if code and (inner := nested(package, code)):
            yield from _lines(inner[0], "msg", inner[1], depth + 1)


def nested(package: str, code: str) -> tuple[str, str] | None:
    """Return package and name of the message type of the field that a line declares, or None."""
    if code.strip() == "---":
        return None
    base = re.split(r"[\[<]", code.split()[0])[0]
    if base in PRIMITIVES or "=" in code.split()[0]:
        return None
    return (base.split("/")[0], base.split("/")[-1]) if "/" in base else (package, base)


def run_proto(args: argparse.Namespace) -> None:
    """Print all fields of an interface in the form in which values are given on a command line."""
    parts = args.type.split("/")
    kind = parts[1] if len(parts) == 3 and parts[1] in KINDS else "msg"
    print(f'"{messages.to_yaml(messages.prototype(args.type, kind))}"')
