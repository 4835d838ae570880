"""`grader release`: what is in the students' kit, what is not, and that the course works with it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from helpers.course import COURSE, PACKAGE
from helpers.notebook_rules import Page, has_no_outputs, links_lead_somewhere

from grader.authoring import book, checkpoint_texts, notebook_run, notebook_source, release
from grader.errors import GraderError
from grader.notebook import checkpoints, lanes
from grader.scoring.rubric import Rubric, load

WITHHELD = (
    "solution_pkg/", "tests/", ".git/", ".github/", "grader/authoring", "grader/classroom",
    "grader/selftest", "notebooks/published", "notebooks/source", "out/",
)  # fmt: skip


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("release") / "kit.zip"
    release.release(out, COURSE)
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


def test_the_kit_is_one_folder_with_everything_a_student_needs(kit: Path):
    assert {path.name for path in kit.iterdir()} == {
        ".ci", ".gitignore", "LICENSE", "Makefile", "README.md", "docs", "grader", "notebooks", "pyproject.toml",
        "requirements.txt", "rubric.yaml", "sim",
    }  # fmt: skip
    assert {f"notebooks/{path.name}" for path in notebook_source.NOTEBOOKS.glob("*.ipynb")} <= set(names(kit))
    home = "grader/courses/robot_controller"
    others = ("docs/handout.md", "docs/turtlebot4/turtlebot4_launch.py", "docs/turtlebot4/adapter.py")
    assert {*others, f"{home}/lessons/clinic.py", f"{home}/lessons/frames.py"} <= set(names(kit))


def test_the_kit_holds_nothing_meant_for_instructors(kit: Path):
    assert [name for name in names(kit) if name.startswith(WITHHELD) or "__pycache__" in name] == []


def test_the_notebooks_of_the_kit_have_no_outputs(kit: Path):
    for name in checkpoints.table():
        page = Page(name, book.read_stored(kit / "notebooks" / f"{name}.ipynb"), kit / "notebooks")
        assert list(has_no_outputs(page)) == []


def test_the_kits_pages_say_what_students_need(kit: Path):
    """A student on a Mac, on an old Linux or in another user's folder met these sentences only after the download."""
    notebooks, readme = (kit / "notebooks" / "README.md").read_text(), (kit / "README.md").read_text()
    assert "published" not in notebooks
    assert notebooks.startswith("# The notebooks\n")
    assert "## Open them" in notebooks
    for words in ("glibc 2.28", "WSL 2", "macOS and arm64", "folder of your own", "copy the kit without `.venv`"):
        assert words in readme


def test_the_kit_holds_no_solved_exercise(kit: Path):
    """The handout prints the interfaces; no readable file holds any other solution."""
    texts = {name: (kit / name).read_text(errors="replace") for name in names(kit)}
    readable = "\n".join(text.replace("\\n", "\n").replace('\\"', '"') for text in texts.values())
    for notebook in checkpoints.table():
        for path in checkpoints.checkpoint(notebook).exercises:
            if path.startswith(("msg/", "srv/", "action/")):
                continue
            longest = max(checkpoint_texts.solution(notebook, path).split("\n\n"), key=len)
            assert longest not in readable, path


def test_without_solutions_none_are_packed(tmp_path: Path):
    release.release(tmp_path / "kit.zip", COURSE, solutions=False)
    with zipfile.ZipFile(tmp_path / "kit.zip") as opened:
        assert [name for name in opened.namelist() if name.endswith(".bin")] == []


def test_the_same_tree_gives_the_same_bytes(archive: Path, tmp_path: Path):
    release.release(tmp_path / "again.zip", COURSE)
    assert (tmp_path / "again.zip").read_bytes() == archive.read_bytes()


def test_setup_installs_the_requirements_of_the_kit_without_developers_tools(kit: Path):
    project = tomllib.loads((kit / "pyproject.toml").read_text())
    assert set(project["project"]["optional-dependencies"]) == {"ros", "build", "grade", "notebooks", "setup"}
    assert set(project["tool"]) == {"setuptools"}
    pinned = {line.split("==")[0] for line in (kit / "requirements.txt").read_text().splitlines() if "==" in line}
    needed = {"jupyterlab", "ros-jazzy-rclpy", "colcon-core", "pymunk", "setuptools", "pytest", "nbformat", "uv"}
    assert needed <= pinned
    assert not pinned & {"mypy", "ruff", "jupytext", "nbval"}
    assert "entry-points" not in project["project"]  # it would name a module that the kit does not have


def test_a_package_with_one_pin_for_each_python_keeps_all_of_them():
    pins = """\
mypy==1.20
    # via ros2-course-kit (pyproject.toml)
numpy==2.4.6 ; python_full_version < '3.12'
    # via
    #   ros2-course-kit (pyproject.toml)
    #   contourpy
numpy==2.5.5 ; python_full_version >= '3.12'
    # via contourpy
of-mypy==1.0
    # via mypy
of-numpy==1.0
    # via
    #   mypy
    #   numpy
"""
    kept = [line.split("==")[0] for line in release.pins(pins).splitlines() if "==" in line]
    assert kept == ["numpy", "numpy", "of-numpy"]


def test_the_links_of_the_kit_lead_to_files_in_it(kit: Path):
    import nbformat

    for path in (kit / "README.md", kit / "notebooks" / "README.md", *(kit / "docs").glob("*.md")):
        page = Page(
            path.stem, nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell(path.read_text())]), path.parent
        )
        assert list(links_lead_somewhere(page)) == [], path.name


PATH = re.compile(r"`[^`\n]*?\b((?:grader|sim|tests|docs|notebooks|benchmarks|solution_pkg|\.ci|\.github)/[\w./-]*)")


def pages_of(kit: Path) -> dict[str, str]:
    """Return the text of every page and notebook that a student reads."""
    found = {path.relative_to(kit).as_posix(): path.read_text() for path in kit.rglob("*.md")}
    for path in (kit / "notebooks").glob("*.ipynb"):
        cells = book.read_stored(path).cells
        found[path.name] = "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    return found


def test_the_pages_of_the_kit_name_only_what_is_in_it(kit: Path):
    """No test, benchmark, verb or target of instructors that a student would look for in vain."""
    targets = set(re.findall(r"(?m)^([a-z-]+):", (kit / "Makefile").read_text()))
    verbs = set(re.findall(r"(?m)^ {4}([a-z-]+)", in_kit(kit, "--help").stdout))
    for page, text in pages_of(kit).items():
        assert [name for name in PATH.findall(text) if not (kit / name).exists()] == [], page
        assert set(re.findall(r"(?m)(?:`|^ {4})make ([a-z-]+)", text)) <= targets, page
        assert set(re.findall(r"(?m)(?:`|^ {4})(?:\.venv/bin/)?grader ([a-z][a-z-]*)", text)) <= verbs, page
    for path in (kit / "grader").rglob("*.py"):  # `grader doctor` told students to run `sudo -E make grade`
        assert set(re.findall(r"(?:[\"`]|&& |-E )make ([a-z-]+)[\"`]", path.read_text())) <= targets, path.name


def test_make_help_lists_every_target(kit: Path):
    shown = subprocess.run(["make", "help"], cwd=kit, capture_output=True, text=True, check=True).stdout
    assert {line.split()[1] for line in shown.splitlines()} == {"help", "setup", "jupyter", "doctor", "submit", "clean"}


def in_kit(kit: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the kit's own `grader`, with this environment's packages."""
    return subprocess.run(
        [sys.executable, "-m", "grader.cli", *arguments],
        cwd=kit, env=os.environ | {"PYTHONPATH": str(kit)} | environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_the_kits_grader_runs_and_has_no_verb_release(kit: Path):
    assert "submit" in in_kit(kit, "--help").stdout
    assert in_kit(kit, "release", "--out", "kit.zip").returncode == 2


@pytest.mark.slow  # all notebooks and a whole grading
@pytest.mark.ros
@pytest.mark.sandbox
def test_the_whole_course_works_in_the_released_kit(kit: Path, rubric: Rubric, tmp_path: Path):
    """Each of its notebooks, solved, in order; the package then gets all points from the kit's own grader."""
    workspace = kit / "ws"
    for name in checkpoints.table():
        notebook = book.read_stored(kit / "notebooks" / f"{name}.ipynb")
        run = notebook_run.execute(notebook_run.solved(name, notebook, checkpoint_texts.solution), workspace, kit)
        assert run.error is None
        assert notebook_run.answered_otherwise(run.notebook) == [], run.answers
    graded = in_kit(kit, "grade", str(workspace / "src" / PACKAGE), "--out", str(tmp_path))
    assert graded.returncode == 0, graded.stderr
    assert json.loads((tmp_path / "report.json").read_text())["total"] == 100


@pytest.mark.ros
def test_start_at_works_in_the_released_kit(kit: Path, tmp_path: Path):
    """The kit has no solution_pkg: the texts come from the packed checkpoints."""
    code = "import grader; from grader.notebook import start_at; print(grader.__file__); start_at('05')"
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=notebook_run.environment(tmp_path / "ws", kit),
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.startswith(str(kit))
    package = tmp_path / "ws" / "src" / PACKAGE
    assert (package / PACKAGE / "sensor_processor.py").is_file()


# -- a lane ------------------------------------------------------------------------------------------------------------


def test_a_kit_for_a_lane_has_its_notebooks_and_beside_it_a_rubric_of_what_it_asks_for(
    tmp_path: Path, archive: Path, rubric: Rubric
):
    said = release.release(tmp_path / "kit.zip", COURSE, lane="core")
    assert said.endswith(
        "the notebooks are those of the lane core, and kit.rubric.yaml is the rubric of what it asks for"
    )
    with zipfile.ZipFile(tmp_path / "kit.zip") as core, zipfile.ZipFile(archive) as whole:
        changed = {name for name in core.namelist() if core.read(name) != whole.read(name)}
        text = core.read(f"{release.TOP}/notebooks/05_moving_safely.ipynb").decode()
    assert changed == {f"{release.TOP}/notebooks/{n}.ipynb" for n in checkpoints.table() if n[:2] < "11"}
    assert "<details><summary>Whole lane, " in text
    assert 'lane=\\"core\\"' in text
    profile = load(tmp_path / "kit.rubric.yaml")
    assert {r.id for r in profile.requirements} == set(lanes.asked_for("core"))
    assert sum(r.points for r in profile.requirements) == 85


def test_a_lane_that_gives_solved_pieces_is_not_released_without_them(tmp_path: Path):
    with pytest.raises(GraderError, match="cannot be released without solutions"):
        release.release(tmp_path / "kit.zip", COURSE, lane="core", solutions=False)
    with pytest.raises(GraderError, match="There is no lane 'cor'; there are core, whole"):
        release.release(tmp_path / "kit.zip", COURSE, lane="cor")
