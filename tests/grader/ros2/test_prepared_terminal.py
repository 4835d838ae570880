"""`source grader/ros2/setup.bash`, typed into a new terminal: what is set afterwards, in bash and in zsh."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.ros2_runs import COMMAND
from helpers.terminal import needs_zsh

from grader import KIT
from grader.host import ros_env
from grader.notebook.workspace import Workspace, find, shell_lines

START = {"bash": ["bash", "--norc", "--noprofile"], "zsh": ["zsh", "-f"]}

pytestmark = pytest.mark.skipif(
    Path(sys.prefix) != KIT / ".venv", reason="the tests run in another environment than .venv: make setup"
)


@pytest.fixture(params=["bash", needs_zsh("zsh")])
def shell(request: pytest.FixtureRequest) -> str:
    return request.param


def type_into(shell: str, lines: str, folder: Path, **environment: str) -> str:
    """Return what a new shell prints on both streams."""
    scratch = {"PATH": "/usr/bin:/bin", "HOME": str(folder), **environment}
    ran = subprocess.run(
        [*START[shell], "-c", lines],
        cwd=folder, env=scratch, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
    )  # fmt: skip
    return ran.stdout


def prepared(shell: str, line: str, folder: Path, **environment: str) -> str:
    return type_into(shell, f"source {COMMAND}/setup.bash\n{line}", folder, **environment)


def test_it_prints_nothing_and_the_tools_are_the_kits(shell: str, tmp_path: Path):
    said = prepared(shell, "command -v ros2 colcon python", tmp_path)
    assert said.split() == [f"{KIT}/.venv/bin/{tool}" for tool in ("ros2", "colcon", "python")]


def test_the_terminal_hears_the_nodes_of_the_notebooks(shell: str, tmp_path: Path):
    assert prepared(shell, "echo $ROS_DOMAIN_ID", tmp_path) == f"{find(KIT).domain_id}\n"


@pytest.mark.slow  # a shell that starts the kit's Python several times
def test_it_can_be_sourced_twice_in_another_environment_where_unset_variables_are_errors(shell: str, tmp_path: Path):
    lines = f"set -u; source {COMMAND}/setup.bash; source {COMMAND}/setup.bash; command -v ros2"
    assert type_into(shell, lines, tmp_path, VIRTUAL_ENV="/home/me/other") == f"{KIT}/.venv/bin/ros2\n"


def test_a_build_gets_the_hook_of_the_grader():
    """Without it a package with interfaces does not build; a slow test does build one."""
    named = re.search(r"\$\{CMAKE_CURRENT_LIST_DIR\}/(\S+\.cmake)", (COMMAND / "wheels.cmake").read_text())
    assert named is not None
    assert (COMMAND / named[1]).resolve() == ros_env.CMAKE_HOOK


def test_without_an_environment_it_says_how_to_make_one(shell: str, tmp_path: Path):
    copy = tmp_path / "grader" / "ros2" / "setup.bash"
    copy.parent.mkdir(parents=True)
    copy.write_text((COMMAND / "setup.bash").read_text())
    said = type_into(shell, f"source {copy} || echo not prepared", tmp_path)
    assert said == f"There is no environment yet. Type: make -C {tmp_path} setup\nnot prepared\n"


def test_a_package_that_was_built_before_is_sourced(shell: str, tmp_path: Path):
    install = tmp_path / "my ws" / "install"
    install.mkdir(parents=True)
    (install / f"local_setup.{shell}").write_text('echo "the package"\n')
    lines = shell_lines(shell, Workspace(tmp_path / "my ws"))
    assert type_into(shell, lines, tmp_path) == "the package\n"


def test_there_is_nothing_to_source_before_the_first_build(tmp_path: Path):
    assert [line.partition("=")[0] for line in shell_lines("bash", Workspace(tmp_path)).splitlines()] == [
        "export ROS_DOMAIN_ID",
        "export ROS_AUTOMATIC_DISCOVERY_RANGE",
        "export FASTRTPS_DEFAULT_PROFILES_FILE",
    ]
