"""The course's notebooks as they are stored: nothing here runs them."""

from __future__ import annotations

import ast
import contextlib
import re
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import ament_flake8
import pytest
from helpers.notebook_fixtures import published_page, source_page, student_page
from helpers.notebook_rules import OF_PUBLISHED, OF_SOURCES, OF_STUDENTS, Page, Rule, sections_of_the_rubric_are_there

from grader import KIT, python_ast
from grader.authoring import book, checkpoint_texts, notebook_source
from grader.notebook import checkpoints, lanes, pieces
from grader.scoring.rubric import Rubric

NAMES = notebook_source.names()
RULES = [
    *((source_page, rule) for rule in OF_SOURCES),
    *((student_page, rule) for rule in OF_STUDENTS),
    *((published_page, rule) for rule in OF_PUBLISHED),
]


def expect_none(problems: Iterable[str]) -> None:
    """Fail with the list of all problems, so that an author can fix them at once."""
    found = list(problems)
    assert not found, "\n".join(found)


def test_the_course_has_all_its_notebooks(rubric: Rubric):
    taught = {requirement.section.partition("#")[0] for requirement in rubric.requirements}
    assert list(checkpoints.table()) == NAMES
    assert taught <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_both_editions_match_their_source(name: str, rubric: Rubric):
    expect_none(book.Notebook(name, rubric).differences())


@pytest.mark.parametrize(("page", "rule"), RULES, ids=[f"{page.__name__}-{rule.__name__}" for page, rule in RULES])
@pytest.mark.parametrize("name", NAMES)
def test_each_notebook_keeps_the_rules(page: Callable[[str], Page], rule: Rule, name: str):
    expect_none(rule(page(name)))


@pytest.mark.parametrize("name", NAMES)
def test_requirements_are_taught_where_the_rubric_says(name: str, rubric: Rubric):
    expect_none(sections_of_the_rubric_are_there(source_page(name), rubric))


@pytest.mark.parametrize("name", NAMES)
def test_each_file_of_a_checkpoint_has_one_cell(name: str):
    checkpoint = checkpoints.checkpoint(name)
    asked = {notebook_source.EXERCISE, notebook_source.SKELETON}
    for tags, files in ((asked, checkpoint.exercises), ({notebook_source.GIVEN}, checkpoint.given)):
        cells = [cell for cell in source_page(name).code() if tags & set(notebook_source.tags(cell))]
        assert sorted(filter(None, map(notebook_source.written_file, cells))) == sorted(files), f"cells tagged {tags}"


@pytest.mark.parametrize("name", NAMES)
def test_no_exercise_ships_its_solution(name: str):
    for cell in source_page(name).code():
        path = notebook_source.written_file(cell)
        if path and notebook_source.EXERCISE in notebook_source.tags(cell):
            assert notebook_source.body(cell) != checkpoint_texts.solution(name, path), path


def test_no_function_that_stays_in_a_notebook_ships_its_solution():
    cells = [(name, cell) for name in NAMES for cell in source_page(name).code()]
    functions = [(name, cell) for name, cell in cells if notebook_source.FUNCTION in notebook_source.tags(cell)]
    assert {name[:2] for name, _ in functions} == {"00", "04", "05", "07", "12"}
    for name, cell in functions:
        solved = pieces.filled(cell.source, notebook_source.functions(name))
        assert all(a != b for a, b in zip(functions_of(cell.source).items(), functions_of(solved).items(), strict=True))


@pytest.mark.parametrize("name", NAMES)
def test_a_skeleton_with_its_pieces_is_the_solution(name: str):
    """Who fills every piece has the file that the next notebook builds on, word for word.

    Of the solution's tests the notebook may ask for a part: those it has are the solution's.
    """
    files: dict[str, str] = {}
    for cell in source_page(name).code():
        body = notebook_source.body(cell)
        if notebook_source.SKELETON in notebook_source.tags(cell):
            files[notebook_source.written_file(cell) or ""] = body
        elif path := notebook_source.piece_file(cell):
            solved = pieces.filled(body, checkpoint_texts.solution(name, path))
            assert solved.rstrip() != body.rstrip(), f"the piece {cell['id']} ships its solution"
            files[path] = pieces.merged(files[path], solved)
    for path, text in files.items():
        solution = checkpoint_texts.solution(name, path)
        if path.startswith("test/"):
            assert functions_of(text).items() <= functions_of(solution).items(), path
        else:
            assert text == solution, path


@pytest.mark.slow  # the linter over each notebook
@pytest.mark.parametrize("name", NAMES)
def test_the_linter_finds_nothing_in_what_the_notebook_writes(name: str, tmp_path: Path):
    """Q1's rules hold for what we write; in unfinished code a name may wait for the line that uses it."""
    given: dict[str, str] = {}
    unfinished: dict[str, str] = {}
    for number, cell in enumerate(source_page(name).code()):
        if path := notebook_source.written_file(cell):
            is_given = notebook_source.GIVEN in notebook_source.tags(cell)
            (given if is_given else unfinished)[path] = notebook_source.body(cell)
        elif path := notebook_source.piece_file(cell):
            unfinished[f"{number}/{path}"] = pieces.merged(unfinished[path], notebook_source.body(cell))
    assert findings(given, tmp_path) == ""
    assert findings(unfinished, tmp_path, "--extend-ignore=F401,F841") == ""


def findings(files: dict[str, str], folder: Path, *options: str) -> str:
    """Return what flake8 finds in the Python files under the rules of ament_flake8."""
    python = {path: text for path, text in files.items() if path.endswith(".py") or text.startswith("#!")}
    for path, text in python.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    rules = Path(ament_flake8.__file__).parent / "configuration" / "ament_flake8.ini"
    command = [sys.executable, "-m", "flake8", f"--config={rules}", "--disable-noqa", *options, *python]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False).stdout if python else ""


def functions_of(text: str) -> dict[str, str]:
    """Return the text of each function of a module by its name, without the comments below it."""
    lines = text.splitlines()
    return {
        found.name: "\n".join(line for line in lines[found.start : found.end] if not line.startswith("#"))
        for found in pieces.definitions(text)
    }


@pytest.mark.parametrize("name", ["06_services", "07_going_there"])
def test_a_node_on_the_bench_hears_its_sensors(name: str):
    """Attributes that were set by hand suited one design only, and went past the callbacks that a learner writes."""
    for cell in source_page(name).code():
        assert not re.search(r"\.node\._(near|pose|\w+_time)\b[^=\n]*=", cell.source), cell["id"]


def test_each_requirement_is_checked_in_some_notebook(rubric: Rubric):
    asked = {name for page in map(source_page, NAMES) for cell in page.code() for name in notebook_source.checked(cell)}
    assert {requirement.id for requirement in rubric.requirements} - asked == set()


def rows_of_the_glossary() -> list[list[str]]:
    """Return the rows of the glossary's tables, each as its cells: what, its sentence, where it is taught."""
    lines = (KIT / "docs" / "glossary.md").read_text().splitlines()
    tables = [line.strip("|").split(" | ") for line in lines if line.startswith("| ")]
    return [[cell.strip() for cell in row] for row in tables if row[-1].strip() != "taught in"]


def test_the_glossary_names_sections_that_exist():
    """A section of a notebook that is renamed is renamed there, too."""
    known = {
        f"{name[:2]}: {title}"
        for name in NAMES
        for cell in source_page(name).notebook.cells
        for level, title in notebook_source.headings(cell)
        if level == 2
    }
    assert [row for row in rows_of_the_glossary() if len(row) != 3 or row[2] not in known] == []


def test_each_ros2_command_of_the_notebooks_is_on_the_cheat_sheet():
    said = "\n".join(cell.source for name in NAMES for cell in source_page(name).notebook.cells)
    used = {found[1] for found in re.finditer(r"(?<![\w.-])ros2 (" + "|".join(command_words()) + r")\b", said)}
    listed = {
        found[1] for row in rows_of_the_glossary() if (found := re.match(r"`ros2 ([a-z]+(?: [a-z_]+)?)\b", row[0]))
    }
    assert used - listed == set()


def command_words() -> list[str]:
    """Return the commands of our `ros2` with their verbs, such as "topic echo" and "run"."""
    page = (KIT / "docs" / "ros2-command.md").read_text()
    table = re.findall(r"^\| `ros2 (\w+)[^`]*` \| (.*) \|$", page, re.MULTILINE)
    return [f"{name} {verb}" for name, verbs in table for verb in re.findall(r"`(\w+)`", verbs)] + ["run", "launch"]


@pytest.mark.parametrize("name", NAMES)
def test_each_notebook_ends_with_where_the_learner_stands(name: str):
    assert source_page(name).notebook.cells[-1].source.endswith("\nprogress()")


def test_the_table_of_sections_matches_the_rubric_and_the_notebooks(rubric: Rubric):
    page = book.PAGE.read_text()
    assert book.with_table(page, rubric) == page, "run `python -m grader.authoring.book table`"


# -- lanes -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lane", [lane for lane in lanes.table() if lane != lanes.WHOLE])
@pytest.mark.parametrize("name", NAMES)
def test_a_lane_gives_what_the_cells_that_it_leaves_out_would_have_written(name: str, lane: str):
    left_out: dict[str, set[str]] = {}
    for cell in source_page(name).code():
        if lanes.WHOLE in notebook_source.tags(cell):
            if path := notebook_source.piece_file(cell):
                names = {found.name for found in pieces.definitions(notebook_source.body(cell))}
                left_out.setdefault(path, set()).update(names)
            elif path := notebook_source.written_file(cell):
                left_out.setdefault(path, set())
    whole_files = {path for path, names in lanes.given(lane, name[:2]).items() if not names}
    given = {path: set(names) for path, names in lanes.given(lane, name[:2]).items() if names}
    assert {path: names for path, names in left_out.items() if path not in whole_files} == given
    assert whole_files <= set(left_out), "a file that the lane gives and a cell of it writes"


@pytest.mark.parametrize("lane", [lane for lane in lanes.table() if lane != lanes.WHOLE])
def test_a_lane_asks_for_nothing_that_its_cells_do_not_check(lane: str):
    cells = [cell for page in map(source_page, NAMES) for cell in page.code()]
    kept = [cell for cell in cells if lanes.WHOLE not in notebook_source.tags(cell)]
    checked = {name for cell in kept for name in notebook_source.checked(cell)}
    assert set(lanes.asked_for(lane)) - checked == set()


@pytest.mark.parametrize("name", NAMES)
def test_no_cell_of_a_shorter_lane_needs_a_name_of_one_that_it_leaves_out(name: str):
    """Running the lane shows it, too, but takes minutes."""
    known: set[str] = set()
    optional: dict[str, str] = {}
    for cell in source_page(name).code():
        loaded, stored = names_in(cell.source)
        if lanes.WHOLE in notebook_source.tags(cell):
            optional |= dict.fromkeys(stored, cell["id"])
            continue
        needs = {found: optional[found] for found in loaded - stored - known if found in optional}
        assert not needs, f"cell {cell['id']}"
        known |= stored


def names_in(source: str) -> tuple[set[str], set[str]]:
    """Return the names that a cell reads, also in its cases and shell lines, and those that it defines."""
    if source.startswith("%%"):
        return set(), set()
    tree = ast.parse(re.sub(r"(?m)^( *)[!%].*$", r"\1pass", source))
    nodes = list(ast.walk(tree))
    tables = [node for node in nodes if isinstance(node, ast.Dict)]  # of `tries`: the cases are its keys
    cases = [key.value for table in tables for key in table.keys if isinstance(key, ast.Constant)]
    shell = re.findall(r"\{(\w+)\}", " ".join(re.findall(r"(?m)^ *[!%].*$", source)))
    for case in cases:
        with contextlib.suppress(*python_ast.UNPARSABLE):
            nodes += ast.walk(ast.parse(str(case), mode="eval"))
    loaded = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    stored = {node.id for node in nodes if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)}
    stored |= {node.arg for node in nodes if isinstance(node, ast.arg)}
    stored |= {node.name for node in nodes if isinstance(node, python_ast.Function | ast.ClassDef)}
    stored |= {(a.asname or a.name).partition(".")[0] for node in nodes for a in getattr(node, "names", ())
               if isinstance(a, ast.alias)}  # fmt: skip
    return loaded | set(shell), stored
