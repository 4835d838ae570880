"""A file that `%%writefile` overwrites is backed up, unless a cell wrote it."""

from __future__ import annotations

import subprocess
import sys
from datetime import datetime
from pathlib import Path

import pytest

from grader.host.ros_env import PREFIX
from grader.notebook import checkpoints
from grader.notebook.file_backups import FileBackups, target
from grader.notebook.workspace import Workspace

NOON = datetime(2026, 5, 1, 12, 0, 0)
CELL = "%%writefile utils/steering.py\nGAIN = 1\n"


@pytest.fixture
def package(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> Path:
    (workspace.package / "utils").mkdir(parents=True)
    monkeypatch.chdir(workspace.package)
    return workspace.package


def run(backups: FileBackups, cell: str) -> str:
    """Run a `%%writefile` cell as Jupyter does; return the message before it."""
    said = backups.before(cell, NOON)
    path = target(cell)
    assert path is not None
    path.write_text(cell.partition("\n")[2])
    backups.after(cell)
    return said


def copies(workspace: Workspace) -> dict[str, str]:
    folder = workspace.root / "kept"
    return {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*.py")}


def test_a_cell_that_overwrites_an_edit_backs_it_up_and_says_where(workspace: Workspace, package: Path) -> None:
    run(FileBackups(workspace), CELL)
    (package / "utils/steering.py").write_text("GAIN = 2  # an hour of work\n")
    assert run(FileBackups(workspace), CELL) == (
        "steering.py was changed outside this notebook. "
        "That version is kept: ws/kept/utils/steering 2026-05-01 12.00.00.py"
    )
    assert copies(workspace) == {"utils/steering 2026-05-01 12.00.00.py": "GAIN = 2  # an hour of work\n"}
    assert (package / "utils/steering.py").read_text() == "GAIN = 1\n"


def test_text_that_a_cell_wrote_is_overwritten_without_a_message(workspace: Workspace, package: Path) -> None:
    """Also by another notebook, whose kernel has not seen the first cell: the course's files grow from day to day."""
    assert run(FileBackups(workspace), CELL) == ""
    assert run(FileBackups(workspace), CELL) == ""
    assert run(FileBackups(workspace), CELL.replace("1", "3")) == ""
    assert copies(workspace) == {}


def test_an_edit_equal_to_the_cell_is_not_backed_up(workspace: Workspace, package: Path) -> None:
    (package / "utils/steering.py").write_text("GAIN = 1\n")
    assert run(FileBackups(workspace), CELL) == ""


def test_two_edits_in_one_second_are_both_kept(workspace: Workspace, package: Path) -> None:
    for text in ("GAIN = 2\n", "GAIN = 3\n"):
        (package / "utils/steering.py").write_text(text)
        run(FileBackups(workspace), CELL)
    assert sorted(copies(workspace).values()) == ["GAIN = 2\n", "GAIN = 3\n"]


def test_a_file_outside_the_package_is_kept_too(workspace: Workspace, package: Path) -> None:
    (workspace.root / "notes.py").write_text("mine\n")
    run(FileBackups(workspace), "%%writefile ../../notes.py\nof the cell\n")
    assert copies(workspace) == {"elsewhere/notes 2026-05-01 12.00.00.py": "mine\n"}


@pytest.mark.parametrize(
    "cell", ["print(1)", "%%writefile", "%%bash\ncat > a.py", "%%writefile 'half\n", "# %%writefile a.py\nx", ""]
)
def test_another_cell_is_left_alone(cell: str) -> None:
    assert target(cell) is None


def test_spaces_and_the_flag_to_append_are_understood(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    assert target("%%writefile -a 'my file.py'\nx") == (tmp_path / "my file.py").resolve()


def test_damaged_checksums_cost_an_extra_copy_and_no_work(workspace: Workspace, package: Path) -> None:
    run(FileBackups(workspace), CELL)
    (workspace.root / "kept/written.json").write_text("{")
    assert "is kept" in run(FileBackups(workspace), CELL.replace("1", "2"))


def test_begin_installs_the_backups_in_a_kernel(workspace: Workspace) -> None:
    """With IPython's own events and `%%writefile`; after two calls of `begin`, the message comes once."""
    code = (
        "from IPython.core.interactiveshell import InteractiveShell as S\n"
        "s = S.instance()\n"
        "s.run_cell(\"from grader.notebook import begin; begin('01')\")\n"
        "s.run_cell(\"begin('01')\")\n"
        "s.run_cell('%%writefile setup.py\\nONE\\n')\n"
        "open('setup.py', 'w').write('TWO')\n"
        "s.run_cell('%%writefile setup.py\\nONE\\n')\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.count("setup.py was changed outside this notebook. That version is kept: ws/kept/setup ") == 1
    assert copies(workspace).popitem()[1] == "TWO"


def test_colcon_ignores_the_backups(workspace: Workspace) -> None:
    """`!cd ../.. && colcon build` searches the whole workspace, and fails at two packages of one name."""
    checkpoints.start_at(workspace, "02")
    checkpoints.start_at(workspace, "02")
    assert (workspace.root / "backup-1/package.xml").is_file()
    listed = subprocess.run(
        [PREFIX / "bin/colcon", "list", "--names-only"], cwd=workspace.root, capture_output=True, text=True, check=False
    )
    assert listed.stdout.split() == ["ros2_robot_controller"]
