"""`ros2 pkg`: list the packages, show what they hold, and create one."""

from __future__ import annotations

import argparse
import getpass
import os
import re
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

from . import Refusal, arguments, packages

DESCRIPTION = "TODO: Package description"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "pkg")
    create = add_verb("create", "Create a new ROS 2 package", run_create)
    create.add_argument("package_name", help="The package name")
    create.add_argument("--license", default="TODO: License declaration", help="The license, such as Apache-2.0")
    create.add_argument("--build-type", required=True, choices=("ament_python",))
    add_verb("list", "Output a list of available packages", show_list)
    _package(add_verb("prefix", "Output the prefix path of a package", show_prefix))
    _package(add_verb("executables", "Output a list of package specific executables", show_executables), nargs="?")
    _package(add_verb("xml", "Output the XML of the package manifest", show_xml))


def _package(parser: argparse.ArgumentParser, **rest: Any) -> None:
    parser.add_argument("package_name", help="Name of the package", **rest)


def show_list(_args: argparse.Namespace) -> None:
    """Print the packages."""
    print("\n".join(packages.names()))


def show_prefix(args: argparse.Namespace) -> None:
    """Print where a package is installed."""
    print(packages.require(args.package_name))


def show_executables(args: argparse.Namespace) -> None:
    """Print the executables of a package, or of all."""
    for package in [args.package_name] if args.package_name else packages.names():
        for path in packages.executables(package):
            print(f"{package} {path.name}")


def show_xml(args: argparse.Namespace) -> None:
    """Print a package's manifest."""
    share = packages.require(args.package_name) / "share" / args.package_name
    print((share / "package.xml").read_text())


# -- create -----------------------------------------------------------------------------------------------------------
def run_create(args: argparse.Namespace) -> None:
    """Write the package and print what was written."""
    name = args.package_name
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or "__" in name:
        raise Refusal(
            f"Package name '{name}' is not allowed: use lower-case letters, digits and single underscores, "
            "beginning with a letter"
        )
    if Path(name).exists():
        raise Refusal(
            f"\nAborted!\nThe directory already exists: {Path(name).resolve()}\nEither remove the directory or "
            "choose a different package name"
        )
    try:
        user = getpass.getuser()
    except (KeyError, OSError):
        user = "user"
    print(f"going to create a new package\npackage name: {name}\ndestination directory: {Path.cwd()}")
    for file, text in _files(args, user).items():
        path = Path(name) / file
        print(f"creating .{os.sep}{path}")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


# -- the files of a new package: path -> text ------------------------------------------------------------------------
def _files(args: argparse.Namespace, user: str) -> dict[str, str]:
    name = args.package_name
    return {
        "package.xml": PACKAGE_XML.format(
            name=name, user=user, description=DESCRIPTION, license=escape(args.license), type=args.build_type
        ),
        "setup.py": SETUP_PY.format(name=name, user=user, description=DESCRIPTION, license=args.license),
        "setup.cfg": f"[develop]\nscript_dir=$base/lib/{name}\n[install]\ninstall_scripts=$base/lib/{name}\n",
        f"resource/{name}": "",
        f"{name}/__init__.py": "",
        "test/test_copyright.py": COPYRIGHT,
        "test/test_flake8.py": FLAKE8,
        "test/test_pep257.py": PEP257,
    }


PACKAGE_XML = """<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd" schematypens="http://www.w3.org/2001/XMLSchema"?>
<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>{description}</description>
  <maintainer email="{user}@todo.todo">{user}</maintainer>
  <license>{license}</license>

  <test_depend>ament_copyright</test_depend>
  <test_depend>ament_flake8</test_depend>
  <test_depend>ament_pep257</test_depend>
  <test_depend>python3-pytest</test_depend>

  <export>
    <build_type>{type}</build_type>
  </export>
</package>
"""
SETUP_PY = """from setuptools import find_packages, setup

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
        'console_scripts': [
        ],
    }},
)
"""
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
