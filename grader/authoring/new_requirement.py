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


def test_touches_nothing(judge: Judge) -> None:
    """TODO what holds, as students read it: the robot touches nothing."""
    trial = judge.trial("{stem}")
    touched = ", ".join(f"{{touch.obstacle}} at {{touch.t:.1f}} s" for touch in trial.touches)
    judge.expect(not touched, f"touched {{touched}}", "TODO what to try")
'''
_ENTRY = """\
- id: {id}
  title: TODO a few words
  text: TODO what the node has to do, as students read it.
  section: {section}
  checks:
    - {{id: "check_{stem}::test_touches_nothing", points: 1}}
"""
_KNOWN_BAD = """\
# TODO how this node fails to do what {id} asks. Until `new` breaks it, `grader check-course` says that nothing is lost.
file: {file}
old: {old}
new: {new}
loses: {{{id}: 1}}
"""


def add(course: Course, name: str) -> list[Path]:
    """Add the requirement `name` to the rubric's first criterion, and return the files that were written or changed.

    Raises:
        UsageError: there is such a requirement, trial, check or edit, or this is not a name for one.
        GraderError: the rubric cannot be read or inserted into.
    """
    whole, stem = check_course.read_rubric(course), name.lower()
    if not re.fullmatch(r"[A-Za-z]\w*", name):
        raise UsageError(f"{name} is not an id.", "Write a letter and a number, such as X1.")
    scripts = "".join(path.read_text(encoding="utf-8") for path in course.files("trials", "*.py"))
    if name in {requirement.id for requirement in whole.requirements} or f"def {stem}(" in scripts:
        raise UsageError(f"There is a requirement or a trial called {name}; nothing was written.", "Choose another id.")
    module = next(iter(course.nodes.values())).module
    old = _line_to_change((course.solution / module).read_text(encoding="utf-8"))
    service = next((service for node in course.nodes.values() for service in node.services), "")
    words = {
        "id": name,
        "stem": stem,
        "section": json.dumps(whole.criteria[0].requirements[-1].section, ensure_ascii=False),
        "call": f'\n    # stage.call("{service}", ...)' if service else "",
        "file": module,
        "old": json.dumps(old, ensure_ascii=False),
        "new": json.dumps(f"{old}  # TODO", ensure_ascii=False),
    }
    files = {f"trials/{stem}.py": _TRIAL, f"checks/check_{stem}.py": _CHECK, f"known_bad/{stem}.yaml": _KNOWN_BAD}
    paths = {course.folder / path: text.format(**words) for path, text in files.items()}
    if there := [path for path in paths if path.exists()]:
        raise UsageError(f"There is {there[0]}; nothing was written.", "Choose another id.")
    rubric = _inserted(course.rubric, _ENTRY.format(**words))
    for path, text in (paths | {course.rubric: rubric}).items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return [*paths, course.rubric]


def _line_to_change(text: str) -> str:
    """Return a line that a module has once, if there is one that publishes something."""
    lines = [line.strip() for line in text.splitlines()]
    once = [line for line in lines if len(line) > 3 and text.count(line) == 1 and not line.startswith(("#", '"'))]
    return next((line for line in once if ".publish(" in line), once[-1])


def _inserted(path: Path, entry: str) -> str:
    """Return the rubric's text with an entry at the end of its first criterion; comments stay where they are."""
    text = path.read_text(encoding="utf-8").rstrip("\n") + "\n"
    root = yaml_reader.compose(path, text)
    criterion = yaml_reader.value(yaml_reader.value(root, "criteria"), 0)
    listed = yaml_reader.value(criterion, "requirements")
    if not isinstance(listed, yaml.SequenceNode) or listed.flow_style:
        raise GraderError(f"{path}: write the requirements of the first criterion one below the other, each with `- `.")
    lines = text.splitlines(keepends=True)
    end = listed.end_mark.line
    while not lines[end - 1].strip() or lines[end - 1].lstrip().startswith("#"):  # they are about what comes next
        end -= 1
    blank = [] if lines[listed.value[-1].start_mark.line - 1].strip() else ["\n"]
    indent = " " * listed.start_mark.column
    lines[end:end] = [*blank, *(indent + line for line in entry.splitlines(keepends=True))]
    typed = yaml_reader.value(criterion, "points")
    if typed is not None:
        row, first, last = typed.start_mark.line, typed.start_mark.column, typed.end_mark.column
        lines[row] = f"{lines[row][:first]}{float(lines[row][first:last]) + 1:g}{lines[row][last:]}"
    return "".join(lines)
