"""`grader release`: what students get, what they do not, and that the course can be gone through with it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from helpers.notebook_rules import Page, links_lead_somewhere

from grader.authoring import book, checkpoint_texts, notebook_run, notebook_source, release
from grader.contract.spec import PACKAGE
from grader.notebook import checkpoints
from grader.scoring.rubric import Rubric

WITHHELD = (
    "solution_pkg/", "tests/", ".git/", ".github/", "grader/authoring", "grader/selftest", "notebooks/source", "out/",
)  # fmt: skip


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("release") / "kit.zip"
    release.release(out)
    return out


@pytest.fixture(scope="module")
def kit(archive: Path) -> Path:
    with zipfile.ZipFile(archive) as opened:
        opened.extractall(archive.parent)
        for entry in opened.infolist():  # extractall forgets who may be run
            (archive.parent / entry.filename).chmod(entry.external_attr >> 16 & 0o777)
    return archive.parent / release.TOP


def names(kit: Path) -> list[str]:
    return sorted(path.relative_to(kit).as_posix() for path in kit.rglob("*") if path.is_file())


def test_there_is_one_folder_with_what_a_student_needs(kit: Path):
    assert {path.name for path in kit.iterdir()} == {
        ".ci", ".gitignore", "LICENSE", "Makefile", "README.md", "docs", "grader", "notebooks", "pyproject.toml",
        "requirements.txt", "rubric.yaml", "sim",
    }  # fmt: skip
    assert {f"notebooks/{path.name}" for path in notebook_source.NOTEBOOKS.glob("*.ipynb")} <= set(names(kit))
    assert "docs/handout.md" in names(kit)


def test_what_only_an_instructor_has_is_not_in_it(kit: Path):
    assert [name for name in names(kit) if name.startswith(WITHHELD) or "__pycache__" in name] == []


def test_no_exercise_lies_solved_in_it(kit: Path):
    """Interfaces are printed in the handout; all else that a student writes is in no file that can be read."""
    texts = {name: (kit / name).read_text(errors="replace") for name in names(kit)}
    held = "\n".join(text.replace("\\n", "\n").replace('\\"', '"') for text in texts.values())
    for notebook in checkpoints.NOTEBOOKS:
        for path in checkpoints.checkpoint(notebook).exercises:
            if path.startswith(("msg/", "srv/", "action/")):
                continue
            longest = max(checkpoint_texts.solution(notebook, path).split("\n\n"), key=len)
            assert longest not in held, path


def longest_quotation(solution: str, text: str) -> list[str]:
    """Return the most lines in a row of a solution, blank ones apart, that stand in `text` in a row."""
    lines, longest = solution.splitlines(), []
    for begin in range(len(lines)):
        end = begin
        while end < len(lines) and "\n".join(lines[begin : end + 1]) in text:
            end += 1
        longest = max(longest, [line for line in lines[begin:end] if line.strip()], key=len)
    return longest


def test_the_program_of_the_kit_quotes_no_solution(kit: Path):
    """Seven lines at most: the kit builds the contract's interfaces itself, and that takes the same CMake command."""
    programs = {name: (kit / name).read_text() for name in names(kit) if name.endswith((".py", ".txt", ".yaml"))}
    assert "grader/notebook/checkpoints.py" in programs
    for notebook in checkpoints.NOTEBOOKS:
        for path in checkpoints.checkpoint(notebook).exercises:
            for name, text in programs.items():
                quoted = longest_quotation(checkpoint_texts.solution(notebook, path), text)
                assert len(quoted) <= 7, f"{name} has of {path}:\n" + "\n".join(quoted)


def test_without_solutions_none_are_packed(tmp_path: Path):
    release.release(tmp_path / "kit.zip", solutions=False)
    with zipfile.ZipFile(tmp_path / "kit.zip") as opened:
        assert [name for name in opened.namelist() if name.endswith(".bin")] == []


def test_the_same_tree_gives_the_same_bytes(archive: Path, tmp_path: Path):
    release.release(tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == archive.read_bytes()


def test_setup_installs_what_the_kit_asks_for_and_no_developers_tools(kit: Path):
    project = tomllib.loads((kit / "pyproject.toml").read_text())
    assert set(project["project"]["optional-dependencies"]) == {"ros", "build", "grade", "notebooks"}
    assert set(project["tool"]) == {"setuptools"}
    pinned = {line.split("==")[0] for line in (kit / "requirements.txt").read_text().splitlines() if "==" in line}
    assert {"jupyterlab", "ros-jazzy-rclpy", "colcon-core", "pymunk", "setuptools", "pytest", "nbformat"} <= pinned
    assert not pinned & {"mypy", "ruff", "hypothesis", "jupytext", "nbval"}


def test_the_pages_of_the_kit_link_to_what_is_in_it(kit: Path):
    import nbformat

    for path in (kit / "README.md", kit / "notebooks" / "README.md", *(kit / "docs").glob("*.md")):
        page = Page(
            path.stem, nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell(path.read_text())]), path.parent
        )
        assert list(links_lead_somewhere(page)) == [], path.name


def test_every_target_of_its_makefile_is_listed(kit: Path):
    shown = subprocess.run(["make", "help"], cwd=kit, capture_output=True, text=True, check=True).stdout
    assert {line.split()[1] for line in shown.splitlines()} == {"help", "setup", "jupyter", "doctor", "submit", "clean"}


def in_kit(kit: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the kit's own `grader`, with this environment's packages."""
    return subprocess.run(
        [sys.executable, "-m", "grader.cli", *arguments],
        cwd=kit, env=os.environ | {"PYTHONPATH": str(kit)} | environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_its_grader_answers_and_has_nothing_to_release(kit: Path):
    assert "submit" in in_kit(kit, "--help").stdout
    assert in_kit(kit, "release", "--out", "kit.zip").returncode == 2


@pytest.mark.slow
@pytest.mark.ros
@pytest.mark.sandbox
def test_the_course_is_gone_through_in_the_released_kit(kit: Path, rubric: Rubric, tmp_path: Path):
    """Each of its notebooks, solved, in a row; the package then gets all points from the kit's own grader."""
    workspace = kit / "ws"
    for name in checkpoints.NOTEBOOKS:
        notebook = book.read_stored(kit / "notebooks" / f"{name}.ipynb")
        played = notebook_run.play(notebook_run.solved(name, notebook, checkpoint_texts.solution), workspace, kit)
        assert played.error is None
        assert notebook_run.unpassed(played.notebook) == [], "\n".join(notebook_run.said_by_checks(played.notebook))
    graded = in_kit(kit, "grade", str(workspace / "src" / PACKAGE), "--out", str(tmp_path))
    assert graded.returncode == 0, graded.stderr
    assert json.loads((tmp_path / "report.json").read_text())["total"] == 100


@pytest.mark.ros
def test_start_at_works_in_the_released_kit(kit: Path, tmp_path: Path):
    """The kit has no solution_pkg: what is laid out comes from the packed checkpoints."""
    code = "import grader; from grader.notebook import start_at; print(grader.__file__); start_at('05')"
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=notebook_run.environment(tmp_path / "ws", kit),
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.startswith(str(kit))
    package = tmp_path / "ws" / "src" / PACKAGE
    assert (package / PACKAGE / "sensor_processor.py").is_file()
