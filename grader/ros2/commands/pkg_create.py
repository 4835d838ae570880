"""`ros2 pkg create`: write a new package whose tests run with what pip can install."""

from __future__ import annotations

import argparse
import getpass
import os
import re
from pathlib import Path
from xml.sax.saxutils import escape

from .refusals import Refusal

LICENSES = ("Apache-2.0", "BSL-1.0", "BSD-2.0", "BSD-2-Clause", "BSD-3-Clause", "GPL-3.0-only", "LGPL-3.0-only", "MIT")
DESCRIPTION = "TODO: Package description"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare arguments and flags."""
    parser.add_argument("package_name", help="The package name")
    parser.add_argument("--license", default="TODO: License declaration", help=f"The license: {', '.join(LICENSES)}")
    parser.add_argument("--build-type", default="ament_cmake", choices=("ament_cmake", "ament_python"))
    parser.add_argument("--dependencies", nargs="+", default=[], help="list of dependencies")
    parser.add_argument("--node-name", help="name of the empty executable")


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "user"


def run(args: argparse.Namespace) -> int:
    """Write the package and print what was written."""
    name, node = args.package_name, args.node_name
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or "__" in name:
        raise Refusal(
            f"Package name '{name}' is not allowed: use lower-case letters, digits and single underscores, "
            "beginning with a letter"
        )
    if node and args.build_type == "ament_cmake":
        raise Refusal("--node-name writes a node in Python: add --build-type ament_python")
    if node == "test":
        raise Refusal("'test' cannot be the name of a node: the folder of that name holds the tests")
    if Path(name).exists():
        raise Refusal(
            f"\nAborted!\nThe directory already exists: {Path(name).resolve()}\nEither remove the directory or "
            "choose a different package name"
        )
    user = _user()
    print("going to create a new package")
    for title, value in (
        ("package name", name),
        ("destination directory", Path.cwd()),
        ("package format", "3"),
        ("version", "0.0.0"),
        ("description", DESCRIPTION),
        ("maintainer", [f"{user} <{user}@todo.todo>"]),
        ("licenses", [args.license]),
        ("build type", args.build_type),
        ("dependencies", args.dependencies),
        *([("node_name", node)] if node else []),
    ):
        print(f"{title}: {value}")
    files = _python(args, user) if args.build_type == "ament_python" else _cmake(args, user)
    for path, text in files.items():
        _write(Path(name) / path, text)
    if args.license not in LICENSES:
        print(
            f"\n[WARNING]: Unknown license '{args.license}'. This has been set in the package.xml, but no LICENSE "
            "file has been created.\nIt is recommended to use one of the ament license identifiers:\n"
            + "\n".join(LICENSES)
        )
    return 0


def _write(path: Path, text: str) -> None:
    for parent in reversed(path.parents[:-1]):
        if not parent.exists():
            print(f"creating folder .{os.sep}{parent}")
            parent.mkdir(parents=True)
    print(f"creating .{os.sep}{path}")
    path.write_text(text, encoding="utf-8")


# -- the files of a new package: path -> text ------------------------------------------------------------------------
def _manifest(args: argparse.Namespace, user: str, tool: str, *tests: str) -> str:
    lines = [
        '<?xml version="1.0"?>',
        '<?xml-model href="http://download.ros.org/schema/package_format3.xsd" '
        'schematypens="http://www.w3.org/2001/XMLSchema"?>',
        '<package format="3">',
        f"  <name>{args.package_name}</name>",
        "  <version>0.0.0</version>",
        f"  <description>{DESCRIPTION}</description>",
        f'  <maintainer email="{user}@todo.todo">{user}</maintainer>',
        f"  <license>{escape(args.license)}</license>",
        "",
        *([f"  <buildtool_depend>{tool}</buildtool_depend>", ""] if tool else []),
        *(f"  <depend>{name}</depend>" for name in args.dependencies),
        *([""] if args.dependencies else []),
        *(f"  <test_depend>{name}</test_depend>" for name in tests),
        "",
        "  <export>",
        f"    <build_type>{args.build_type}</build_type>",
        "  </export>",
        "</package>",
    ]
    return "\n".join(lines) + "\n"


def _python(args: argparse.Namespace, user: str) -> dict[str, str]:
    name = args.package_name
    found = {
        "package.xml": _manifest(args, user, "", "ament_copyright", "ament_flake8", "ament_pep257", "python3-pytest"),
        "setup.py": SETUP.format(
            name=name,
            user=user,
            description=DESCRIPTION,
            license=args.license,
            scripts=f"\n            '{args.node_name} = {name}.{args.node_name}:main',\n        "
            if args.node_name
            else "\n        ",
        ),
        "setup.cfg": f"[develop]\nscript_dir=$base/lib/{name}\n[install]\ninstall_scripts=$base/lib/{name}\n",
        f"resource/{name}": "",
        f"{name}/__init__.py": "",
        "test/test_copyright.py": COPYRIGHT,
        "test/test_flake8.py": FLAKE8,
        "test/test_pep257.py": PEP257,
    }
    if args.node_name:
        found[f"{name}/{args.node_name}.py"] = f"def main():\n    print('Hi from {name}.')\n\n\n" + MAIN
    return found


def _cmake(args: argparse.Namespace, user: str) -> dict[str, str]:
    find = "".join(f"find_package({name} REQUIRED)\n" for name in args.dependencies)
    return {
        "package.xml": _manifest(args, user, "ament_cmake", "ament_lint_auto", "ament_lint_common"),
        "CMakeLists.txt": CMAKE.format(name=args.package_name, find=find),
    }


SETUP = """from setuptools import find_packages, setup

package_name = '{name}'

setup(
    name=package_name,
    version='0.0.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages',
            ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='{user}',
    maintainer_email='{user}@todo.todo',
    description='{description}',
    license={license!r},
    tests_require=['pytest'],
    entry_points={{
        'console_scripts': [{scripts}],
    }},
)
"""
MAIN = "if __name__ == '__main__':\n    main()\n"
# ament_copyright is on no Python index, so its test is skipped with that reason; the other two run.
COPYRIGHT = """import pytest


@pytest.mark.linter
def test_copyright():
    copyright_ = pytest.importorskip(
        'ament_copyright.main', reason='ament_copyright cannot be installed with pip')
    rc = copyright_.main(argv=['.', 'test'])
    assert rc == 0, 'Found errors'
"""
FLAKE8 = """from ament_flake8.main import main_with_errors
import pytest


@pytest.mark.flake8
@pytest.mark.linter
def test_flake8():
    rc, errors = main_with_errors(argv=[])
    assert rc == 0, \\
        'Found %d code style errors / warnings:\\n' % len(errors) + \\
        '\\n'.join(errors)
"""
PEP257 = """from ament_pep257.main import main
import pytest


@pytest.mark.linter
@pytest.mark.pep257
def test_pep257():
    rc = main(argv=['.', 'test'])
    assert rc == 0, 'Found code style errors / warnings'
"""
CMAKE = """cmake_minimum_required(VERSION 3.8)
project({name})

if(CMAKE_COMPILER_IS_GNUCXX OR CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  add_compile_options(-Wall -Wextra -Wpedantic)
endif()

# find dependencies
find_package(ament_cmake REQUIRED)
{find}
ament_package()
"""
