"""The handout: the assignment for students as Markdown, from the rubric and the course's contract."""

from __future__ import annotations

from pathlib import Path

import jinja2

from grader.course import packages
from grader.course.model import Course
from grader.scoring.rubric import Requirement, Rubric
from grader.words import say


def render(rubric: Rubric, course: Course) -> str:
    """Return the handout for `rubric`, as Markdown. handout.md.j2 in the course's folder is its frame.

    Each line of the frame is a text for the catalogue.
    """
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: _said(course.path(name))),
        trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    files = map(course.interface_file, course.interfaces)
    interfaces = {file: fields((course.contract / file).read_text()) for file in files}
    template = environment.get_template("handout.md.j2")
    return (
        template.render(
            rubric=rubric,
            course=course,
            ids={criterion.id: criterion.span for criterion in rubric.criteria},
            interfaces=interfaces,
            parameters={name: node.defaults for name, node in course.nodes.items()},
            level=level,
            notebook=notebook,
            imports=[
                f"`{module}` {p.version}" if module == p.name else f"`{module}` ({p.name} {p.version})"
                for p in packages.offered()
                for module in p.modules
            ],
            ros=packages.of_ros(course),
        )
        + "\n"
    )


def _said(frame: Path) -> tuple[str, str, None] | None:
    """Return a frame in the language in use, line by line, and where it is, for jinja2 to name."""
    if not frame.is_file():
        return None
    return "\n".join(map(say, frame.read_text(encoding="utf-8").split("\n"))), str(frame), None


def fields(text: str) -> str:
    """Return an interface's fields without its comments."""
    lines = (line.partition("#")[0].rstrip() for line in text.splitlines())
    return "\n".join(line for line in lines if line)


def level(requirement: Requirement) -> str:
    """Return "core", "advanced", or how many points are which; and whether it is judged at hand-in only."""
    core, advanced = requirement.points - requirement.advanced, requirement.advanced
    words = say("core {core:g}, advanced {advanced:g}", core=core, advanced=advanced)
    if not core or not advanced:
        words = say("advanced") if advanced else say("core")
    return f"{words}, {requirement.waits}" if requirement.held_back else words


def notebook(requirement: Requirement) -> str:
    """Return the notebook that teaches a requirement, such as "05"."""
    return requirement.section.partition("_")[0]
