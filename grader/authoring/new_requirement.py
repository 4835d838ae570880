"""Add a requirement to a course, to start from: trial, check, entry in the rubric, known-bad edit."""

from __future__ import annotations

import json
import re
from pathlib import Path

import yaml

from grader import yaml_reader
from grader.authoring import check_course
from grader.course import Course
from grader.errors import GraderError, UsageError

_TRIAL = '''"""{id}: TODO what is done to the node. All that `stage` can do is in docs/own-course-reference.md."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage


@trial(serves=["{id}"], world="open_field")
def {stem}(stage: Stage) -> None:
    """TODO what happens, in a sentence."""
    stage.run(1.0){call}
    stage.mark("asked")
    stage.run(2.0)
'''
_CHECK = '''"""{id}: TODO what is judged. All that `judge` can say is in docs/own-course-reference.md."""

from grader.checks.judge import Judge


def test_{stem}_touches_nothing(judge: Judge) -> None:
    """TODO what holds, as students read it: the robot touches nothing."""
    trial = judge.trial("{stem}")
    touched = ", ".join(f"{{touch.obstacle}} at {{touch.t:.1f}} s" for touch in trial.touches)
    judge.expect(not touched, f"touched {{touched}}", "TODO what to try")
'''
_ENTRY = """\
- id: {id}
{held_back}  title: TODO a few words
  text: TODO what the node has to do, as students read it.
{section}  checks:
    - {{id: "check_{stem}::test_{stem}_touches_nothing", points: 1}}
"""
_KNOWN_BAD = """\
# TODO how this node fails to do what {id} asks. Until `new` breaks it, `grader check-course` says that nothing is lost.
file: {file}
old: {old}
new: {new}
loses: {{{id}: 1}}
"""


def add(course: Course, name: str, *, held_back: bool = False) -> list[Path]:
    """Add the requirement `name` to the rubric's first criterion, and return the files that were written or changed.

    What judges one that is to be held back goes into the course's folder for that.

    Raises:
        UsageError: there is such a requirement, trial, check or edit, or this is not a name for one.
        GraderError: the rubric cannot be read or inserted into, or there is no node to try.
    """
    whole, stem = check_course.read_rubric(course), name.lower()
    if not re.fullmatch(r"[A-Za-z]\w*", name):
        raise UsageError(f"{name} is not an id.", "Write a letter and a number, such as X1.")
    scripts = "".join(path.read_text(encoding="utf-8") for path in course.files("trials", "*.py"))
    if name in {requirement.id for requirement in whole.requirements} or f"def {stem}(" in scripts:
        raise UsageError(f"There is a requirement or a trial called {name}; nothing was written.", "Choose another id.")
    module, old = _line_to_change(course)
    service = next((service for node in course.nodes.values() for service in node.services), "")
    section = next((requirement.section for requirement in whole.requirements if requirement.section), "")
    words = {
        "id": name,
        "stem": stem,
        "held_back": "  held_back: true\n" if held_back else "",
        "section": f"  section: {json.dumps(section, ensure_ascii=False)}\n" if section else "",
        "call": f'\n    # stage.call("{service}", ...)' if service else "",
        "file": module,
        "old": json.dumps(old, ensure_ascii=False),
        "new": json.dumps(f"{old}  # TODO", ensure_ascii=False),
    }
    home = course.held_back if held_back else course.folder
    files = {home / f"trials/{stem}.py": _TRIAL, home / f"checks/check_{stem}.py": _CHECK}
    files |= {course.folder / f"known_bad/{stem}.yaml": _KNOWN_BAD}
    taken = [*course.files("checks", f"check_{stem}.py"), *files]
    if there := [path for path in taken if path.exists()]:
        raise UsageError(f"There is {there[0]}; nothing was written.", "Choose another id.")
    rubric = _inserted(course.rubric, _ENTRY.format(**words))
    for path, text in ({path: text.format(**words) for path, text in files.items()} | {course.rubric: rubric}).items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return [*files, course.rubric]


def _line_to_change(course: Course) -> tuple[str, str]:
    """Return a node's module and a line that it has once: one that publishes something, if there is one.

    Raises:
        GraderError: the solution has no such line.
    """
    for module in (node.module for node in course.nodes.values() if (course.solution / node.module).is_file()):
        text = (course.solution / module).read_text(encoding="utf-8")
        lines = [line.strip() for line in text.splitlines()]
        once = [line for line in lines if len(line) > 3 and text.count(line) == 1 and not line.startswith(("#", '"'))]
        if once:
            return module, next((line for line in once if ".publish(" in line), once[-1])
    raise GraderError(f"The solution, {course.solution}, has no node that an edit could break. Write one first.")


def _inserted(path: Path, entry: str) -> str:
    """Return the rubric's text with an entry at the end of its first criterion; comments stay where they are.

    Raises:
        GraderError: that has no requirements, or they are written in brackets.
    """
    text = path.read_text(encoding="utf-8").rstrip("\n") + "\n"
    criterion = yaml_reader.value(yaml_reader.value(yaml_reader.compose(path, text), "criteria"), 0)
    listed = yaml_reader.value(criterion, "requirements")
    if not isinstance(listed, yaml.SequenceNode) or listed.flow_style or not listed.value:
        raise GraderError(
            f"{path}: the first criterion has no list of requirements, one below the other, each with `- `. "
            "Write its first one yourself."
        )
    lines = text.splitlines(keepends=True)
    if typed := yaml_reader.value(criterion, "points"):
        row, cell = typed.start_mark.line, slice(typed.start_mark.column, typed.end_mark.column)
        lines[row] = f"{lines[row][: cell.start]}{float(lines[row][cell]) + 1:g}{lines[row][cell.stop :]}"
    end, indent = listed.end_mark.line, listed.start_mark.column
    while not lines[end - 1].strip() or lines[end - 1].lstrip().startswith("#"):  # they are about what comes next
        end -= 1
    blank = [] if lines[listed.value[-1].start_mark.line - 1].strip() else ["\n"]
    lines[end:end] = [*blank, *(" " * indent + line for line in entry.splitlines(keepends=True))]
    return "".join(lines)
