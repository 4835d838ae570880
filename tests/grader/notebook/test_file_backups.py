"""A file that `%%writefile` overwrites is backed up, unless a cell wrote it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from grader import KIT
from grader.authoring import book
from grader.host.ros_env import PREFIX
from grader.notebook import before_begin, checkpoints
from grader.notebook.file_backups import FileBackups, target
from grader.notebook.workspace import Workspace

CELL = "%%writefile utils/steering.py\nGAIN = 1\n"


@pytest.fixture
def package(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> Path:
    (workspace.package / "utils").mkdir(parents=True)
    monkeypatch.chdir(workspace.package)
    return workspace.package


def parts(cell: str) -> tuple[str, str, str]:
    """Return a cell's magic, the rest of that line, and its text."""
    first, _, text = cell.partition("\n")
    magic, _, line = first.removeprefix("%%").partition(" ")
    return magic, line, text


def run(backups: FileBackups, cell: str) -> str:
    """Run a `%%writefile` cell as Jupyter does; return the message before it."""
    _, line, text = parts(cell)
    path = target(line)
    assert path is not None
    said = backups.keep(path, text)
    path.write_text(text)
    backups.note(path, "")
    return said


def copies(workspace: Workspace) -> dict[str, str]:
    folder = workspace.root / "kept"
    return {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*.py") if ".written" not in p.parts}


def test_a_cell_that_overwrites_an_edit_backs_it_up_and_says_where(workspace: Workspace, package: Path) -> None:
    """The last edit is kept, whichever cells run after it."""
    assert run(FileBackups(workspace), CELL) == ""
    for edit in ("GAIN = 2\n", "GAIN = 3  # an hour of work\n"):
        (package / "utils/steering.py").write_text(edit)
        assert run(FileBackups(workspace), CELL) == (
            "steering.py was changed outside this notebook. That version is kept: ws/kept/utils/steering.py"
        )
    assert run(FileBackups(workspace), CELL.replace("1", "4")) == "", "a text that a cell has is not kept"
    assert copies(workspace) == {"utils/steering.py": "GAIN = 3  # an hour of work\n"}
    assert (package / "utils/steering.py").read_text() == "GAIN = 4\n"


def test_an_edit_equal_to_the_cell_is_not_backed_up(workspace: Workspace, package: Path) -> None:
    (package / "utils/steering.py").write_text("GAIN = 1\n")
    assert run(FileBackups(workspace), CELL) == ""


def test_a_file_outside_the_package_is_kept_too(workspace: Workspace, package: Path) -> None:
    (workspace.root / "notes.py").write_text("mine\n")
    run(FileBackups(workspace), "%%writefile ../../notes.py\nof the cell\n")
    assert copies(workspace) == {"elsewhere/notes.py": "mine\n"}


@pytest.mark.parametrize(("line", "file"), [("", ""), ("'half", ""), ("a b", ""), ("-a 'my file.py'", "my file.py")])
def test_the_file_of_a_cell(line: str, file: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    assert target(line) == ((tmp_path / file).resolve() if file else None)


@pytest.mark.slow  # a build
def test_colcon_ignores_the_backups(workspace: Workspace) -> None:
    """`!cd ../.. && colcon build` searches the whole workspace, and fails at two packages of one name."""
    checkpoints.start_at(workspace, "02")
    checkpoints.start_at(workspace, "02")
    assert (workspace.root / "backup-1/package.xml").is_file()
    listed = subprocess.run(
        [PREFIX / "bin/colcon", "list", "--names-only"], cwd=workspace.root, capture_output=True, text=True, check=False
    )
    assert listed.stdout.split() == ["ros2_robot_controller"]


# -- an earlier notebook run again -------------------------------------------------------------------------------------

INTO = "%%into utils/steering.py\ndef steer():\n    return 1\n"
OTHER = CELL.replace("1", "5")
FORCED = " was not replaced: {}. To replace it all the same, begin the cell with %%writefile -f."
WRITTEN_SINCE = FORCED.format("notebook 08 has written it since, and this cell has the version of notebook 05")
HOLDS_PIECES = FORCED.format("it holds functions that you have put in since, and this cell would empty them")


@pytest.mark.parametrize(
    ("written", "cell", "notebook", "said"),
    [
        ([(CELL, "08")], OTHER, "05", f"steering.py{WRITTEN_SINCE}"),  # 05 put its controller over that of 08
        ([(CELL, "08")], CELL, "05", ""),
        ([(CELL, "08")], OTHER, "08", ""),
        ([(CELL, "08")], OTHER, "09", ""),
        ([(CELL, "08")], OTHER.replace("writefile", "writefile -f"), "05", ""),
        ([(CELL, "08")], "%%writefile other.py\n", "05", ""),
        ([(CELL, "07"), (INTO, "07")], OTHER, "07", f"steering.py{HOLDS_PIECES}"),
        ([(CELL, "07"), (INTO, "07")], INTO, "07", ""),
        ([(CELL, "07"), (INTO, "07")], OTHER.replace("writefile", "writefile -f"), "07", ""),
        ([(CELL, "07"), (INTO, "07")], OTHER.replace("writefile", "writefile -a"), "07", ""),
        ([(CELL, "07"), (INTO, "07")], OTHER, "08", ""),
    ],
)  # fmt: skip
def test_a_cell_replaces_no_later_file_and_no_finished_functions(
    workspace: Workspace,
    package: Path,
    written: list[tuple[str, str]],
    cell: str,
    notebook: str,
    said: str,
) -> None:
    backups = FileBackups(workspace)
    run(backups, CELL)
    for one, number in written:
        backups.note(package / "utils/steering.py", number, parts(one)[0])
    assert backups.refusal(*parts(cell), notebook) == said


def test_files_that_the_course_has_laid_out_belong_to_their_notebook(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    checkpoints.start_at(workspace, "08")
    monkeypatch.chdir(workspace.package)
    cell = "%%writefile ros2_robot_controller/robot_controller.py\nold\n"
    assert "notebook 07 has written it since" in FileBackups(workspace).refusal(*parts(cell), "05")
    checkpoints.start_at(workspace, "05")
    assert FileBackups(workspace).refusal(*parts(cell), "05") == ""


def in_a_kernel(*cells: str, load: str = "", **environment: str) -> str:
    """Run cells in IPython's shell, and return what is printed."""
    code = (
        "from IPython.core.interactiveshell import InteractiveShell\nshell = InteractiveShell.instance()\n"
        f"for name in {load!r}.split(): shell.extension_manager.load_extension(name)\n"
        f"for cell in {cells!r}: shell.run_cell(cell)"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, **environment}
    )
    return ran.stdout + ran.stderr


def begin(notebook: str) -> str:
    return f"from grader.notebook import begin; begin({notebook!r})"


SKELETON = "%%writefile own.py\ndef steer():\n    return 0\n"


def test_begin_installs_all_this_in_a_kernel(workspace: Workspace) -> None:
    """With IPython's own events and `%%writefile`; after two calls of `begin`, a message comes once.

    The skeleton's refusal was taken for the latest text; a comment above a cell magic made it a line magic.
    """
    said = in_a_kernel(
        *[begin("08")] * 2,
        "%%writefile setup.py\nSEVEN\n",
        "open('setup.py', 'w').write('MINE');",
        "%%writefile setup.py\nEIGHT\n",
        begin("05"),
        "%%writefile setup.py\nFIVE\n",
        "print(open('setup.py').read())",
        "%%writefile -f setup.py\nFIVE\n",
        "print(open('setup.py').read())",
        begin("07"),
        SKELETON,
        "# my answer\n\n%%into own.py\ndef steer():\n    return 1\n",
        *[SKELETON] * 2,
        "# a comment\nprint(7)\n",
    )
    assert said.count("setup.py was changed outside this notebook. That version is kept: ws/kept/setup.py\n") == 1
    assert "setup.py was not replaced: notebook 08 has written it since" in said
    assert said.index("EIGHT") < said.index("FIVE")
    assert copies(workspace) == {"setup.py": "MINE"}
    assert "own.py has now: steer\n" in said
    assert said.count("own.py was not replaced") == 2
    assert "return 1" in (workspace.package / "own.py").read_text()
    assert said.endswith("\n7\n")


@pytest.mark.slow  # a kernel
def test_a_learner_who_starts_at_a_notebook_can_write_files_into_new_folders(workspace: Workspace) -> None:
    """The first cell of 08 makes `config` and `launch`, `start_at` moves them away, and %%writefile was a traceback."""
    notebook = book.read_stored(book.student_file("08_settings_and_launch"))
    first, *others = (cell.source for cell in notebook.cells if cell.cell_type == "code")
    written = [cell for cell in others if cell.startswith("%%writefile")]
    said = in_a_kernel(first, "start_at('08')", *written)
    assert "laid out by the course" in said
    assert said.count("\nWriting ") + said.count("\nOverwriting ") + said.count("\nAppending ") == len(written) > 0


# -- before `begin` ----------------------------------------------------------------------------------------------------


@pytest.mark.slow  # one more kernel
def test_after_a_restart_a_cell_writes_nothing_beside_the_notebooks(
    workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file went into notebooks/, and the check was green for the old one."""
    notebooks = tmp_path / "kit" / "notebooks"
    for folder in (notebooks, tmp_path / "kit" / "grader"):
        folder.mkdir(parents=True)
    monkeypatch.chdir(notebooks)
    cell = "%%writefile package.xml\n<package/>\n"
    said = in_a_kernel(cell, begin("01"), cell, load="grader.notebook.before_begin", PYTHONPATH=str(KIT))
    assert "Nothing was written: package.xml would land beside the notebooks. Run the first cell" in said
    assert not list(notebooks.iterdir())
    assert (workspace.package / "package.xml").read_text() == "<package/>\n"


def test_begin_lets_later_kernels_of_the_environment_know(tmp_path: Path) -> None:
    (tmp_path / "pyvenv.cfg").touch()
    setting = tmp_path / "etc/ipython/ipython_config.py"
    before_begin.install(tmp_path)
    before_begin.install(tmp_path)
    assert setting.read_text() == "c.InteractiveShellApp.extensions.append('grader.notebook.before_begin')\n"


def test_a_python_that_is_no_virtual_environment_is_left_alone(tmp_path: Path) -> None:
    before_begin.install(tmp_path)
    assert not list(tmp_path.iterdir())
