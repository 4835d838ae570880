"""What the files of a new package say."""

from __future__ import annotations

from dataclasses import dataclass
from xml.sax.saxutils import escape


@dataclass(frozen=True)
class Facts:
    """What is known of a new package."""

    name: str
    format: str
    description: str
    email: str
    maintainer: str
    license: str
    build_type: str
    dependencies: tuple[str, ...]
    node: str | None


def files(facts: Facts) -> dict[str, str]:
    """Return the files by their path in the package."""
    if facts.build_type == "ament_python":
        return _python(facts)
    return _cmake(facts)


def _manifest(facts: Facts, tool: str, tests: tuple[str, ...]) -> str:
    lines = [
        '<?xml version="1.0"?>',
        f'<?xml-model href="http://download.ros.org/schema/package_format{facts.format}.xsd" '
        'schematypens="http://www.w3.org/2001/XMLSchema"?>',
        f'<package format="{facts.format}">',
        f"  <name>{facts.name}</name>",
        "  <version>0.0.0</version>",
        f"  <description>{escape(facts.description)}</description>",
        f'  <maintainer email="{escape(facts.email)}">{escape(facts.maintainer)}</maintainer>',
        f"  <license>{escape(facts.license)}</license>",
        "",
        *([f"  <buildtool_depend>{tool}</buildtool_depend>", ""] if tool else []),
        *(f"  <depend>{name}</depend>" for name in facts.dependencies),
        *([""] if facts.dependencies else []),
        *(f"  <test_depend>{name}</test_depend>" for name in tests),
        "",
        "  <export>",
        f"    <build_type>{facts.build_type}</build_type>",
        "  </export>",
        "</package>",
    ]
    return "\n".join(lines) + "\n"


def _python(facts: Facts) -> dict[str, str]:
    name = facts.name
    found = {
        "package.xml": _manifest(facts, "", ("ament_copyright", "ament_flake8", "ament_pep257", "python3-pytest")),
        "setup.py": SETUP.format(
            name=name,
            maintainer=_quoted(facts.maintainer),
            email=_quoted(facts.email),
            description=_quoted(facts.description),
            license=_quoted(facts.license),
            scripts=f"\n            '{facts.node} = {name}.{facts.node}:main',\n        "
            if facts.node
            else "\n        ",
        ),
        "setup.cfg": f"[develop]\nscript_dir=$base/lib/{name}\n[install]\ninstall_scripts=$base/lib/{name}\n",
        f"resource/{name}": "",
        f"{name}/__init__.py": "",
        "test/test_copyright.py": COPYRIGHT,
        "test/test_flake8.py": FLAKE8,
        "test/test_pep257.py": PEP257,
    }
    if facts.node:
        found[f"{name}/{facts.node}.py"] = f"def main():\n    print('Hi from {name}.')\n\n\n" + MAIN
    return found


def _quoted(text: str) -> str:
    return repr(text) if "'" not in text else "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _cmake(facts: Facts) -> dict[str, str]:
    find = "".join(f"find_package({name} REQUIRED)\n" for name in facts.dependencies)
    node, source = "", {}
    if facts.node:
        node = NODE.format(node=facts.node, name=facts.name)
        if facts.dependencies:
            node += f"ament_target_dependencies({facts.node}\n  {' '.join(facts.dependencies)}\n)\n"
        node += f"install(TARGETS {facts.node}\n  DESTINATION lib/${{PROJECT_NAME}})\n\n"
        source = {f"src/{facts.node}.cpp": CPP.replace("@NAME@", facts.name)}
    return {
        "package.xml": _manifest(facts, "ament_cmake", ("ament_lint_auto", "ament_lint_common")),
        **source,
        "CMakeLists.txt": CMAKE.format(name=facts.name, find=find, node=node),
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
    maintainer={maintainer},
    maintainer_email={email},
    description={description},
    license={license},
    tests_require=['pytest'],
    entry_points={{
        'console_scripts': [{scripts}],
    }},
)
"""
MAIN = "if __name__ == '__main__':\n    main()\n"
# ament_copyright is on no Python index, so this test says so where it is missing; the other two run.
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
{node}ament_package()
"""
NODE = """add_executable({node} src/{node}.cpp)
target_compile_features({node} PUBLIC c_std_99 cxx_std_17)
"""
CPP = """#include <cstdio>

int main(int argc, char ** argv)
{
  (void) argc;
  (void) argv;

  printf("hello world @NAME@ package\\n");
  return 0;
}
"""
