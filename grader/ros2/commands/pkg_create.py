"""`ros2 pkg create`: a new package whose tests run with what pip can install."""

from __future__ import annotations

import argparse
import getpass
import os
import re
from pathlib import Path
from typing import Any

from . import pkg_templates as templates
from .answers import Refusal

LICENSES = ("Apache-2.0", "BSL-1.0", "BSD-2.0", "BSD-2-Clause", "BSD-3-Clause", "GPL-3.0-only", "LGPL-3.0-only", "MIT")


def add_verb(verbs: Any) -> None:
    """Declare the flags."""
    parser = verbs.add_parser("create", help="Create a new ROS 2 package")
    parser.add_argument("package_name", help="The package name")
    parser.add_argument("--package-format", "--package_format", choices=("2", "3"), default="3", help="format")
    parser.add_argument("--description", default="TODO: Package description", help="The description of the package")
    parser.add_argument("--license", default="TODO: License declaration", help=f"The license: {', '.join(LICENSES)}")
    parser.add_argument("--destination-directory", default=".", type=Path, help="Directory for the package directory")
    parser.add_argument("--build-type", default="ament_cmake", choices=("ament_cmake", "ament_python"))
    parser.add_argument("--dependencies", nargs="+", default=[], help="list of dependencies")
    parser.add_argument("--maintainer-email", help="email address of the maintainer of this package")
    parser.add_argument("--maintainer-name", default=_user(), help="name of the maintainer of this package")
    parser.add_argument("--node-name", help="name of the empty executable")
    parser.add_argument("--library-name", help=argparse.SUPPRESS)
    parser.set_defaults(run=run)


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "user"


def run(args: argparse.Namespace) -> int:
    """Write the package and say what was written."""
    name, node = args.package_name, args.node_name
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or "__" in name:
        raise Refusal(
            f"Package name '{name}' is not allowed: lower-case letters, digits and single underscores, "
            "beginning with a letter"
        )
    if args.library_name:
        raise Refusal("--library-name makes a C++ library, which this kit does not: write it by hand.")
    if node is not None and node == "test":
        raise Refusal("'test' is no name for a node: a folder of that name holds the tests")
    folder = args.destination_directory / name
    if folder.exists():
        raise Refusal(
            f"\nAborted!\nThe directory already exists: {folder.resolve()}\nEither remove the directory or "
            "choose a different destination directory or package name"
        )
    email = args.maintainer_email or f"{args.maintainer_name}@todo.todo"
    facts = templates.Facts(
        name,
        args.package_format,
        args.description,
        email,
        args.maintainer_name,
        args.license,
        args.build_type,
        tuple(args.dependencies),
        node,
    )
    print("going to create a new package")
    for title, value in (
        ("package name", name),
        ("destination directory", args.destination_directory.resolve()),
        ("package format", args.package_format),
        ("version", "0.0.0"),
        ("description", args.description),
        ("maintainer", [f"{args.maintainer_name} <{email}>"]),
        ("licenses", [args.license]),
        ("build type", args.build_type),
        ("dependencies", args.dependencies),
        *([("node_name", node)] if node else []),
    ):
        print(f"{title}: {value}")
    for path, text in templates.files(facts).items():
        _write(args.destination_directory, Path(name) / path, text)
    if args.license not in LICENSES:
        print(
            f"\n[WARNING]: Unknown license '{args.license}'. This has been set in the package.xml, but no LICENSE "
            "file has been created.\nIt is recommended to use one of the ament license identifiers:\n"
            + "\n".join(LICENSES)
        )
    return 0


def _write(root: Path, path: Path, text: str) -> None:
    for parent in reversed(path.parents[:-1]):
        if not (root / parent).exists():
            print(f"creating folder .{os.sep}{parent}")
            (root / parent).mkdir(parents=True)
    print(f"creating .{os.sep}{path}")
    (root / path).write_text(text, encoding="utf-8")
