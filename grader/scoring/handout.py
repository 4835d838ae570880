"""The handout: the assignment for students as Markdown, from the rubric and the contract's interface files."""

from __future__ import annotations

from pathlib import Path

import jinja2

from grader.contract.spec import CONTRACT, HULL_RADIUS_M, INTERFACES, PARAMETERS
from grader.scoring.rubric import Requirement, Rubric

_FOLDER = Path(__file__).parent


def render(rubric: Rubric) -> str:
    """Return the handout for `rubric`, as Markdown. handout.md.j2 is its frame."""
    loader = jinja2.FileSystemLoader(_FOLDER)
    environment = jinja2.Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    interfaces = {
        file: fields((CONTRACT / file).read_text())
        for file in (f"{name}.{name.partition('/')[0]}" for name in INTERFACES)
    }
    template = environment.get_template("handout.md.j2")
    return (
        template.render(
            rubric=rubric,
            interfaces=interfaces,
            parameters=PARAMETERS,
            hull_radius_m=HULL_RADIUS_M,
            level=level,
            notebook=notebook,
        )
        + "\n"
    )


def fields(text: str) -> str:
    """Return an interface's fields without its comments."""
    lines = (line.partition("#")[0].rstrip() for line in text.splitlines())
    return "\n".join(line for line in lines if line)


def level(requirement: Requirement) -> str:
    """Return "core", "advanced", or how many points are which."""
    if not requirement.advanced:
        return "core"
    core = requirement.points - requirement.advanced
    return f"core {core:g}, advanced {requirement.advanced:g}" if core else "advanced"


def notebook(requirement: Requirement) -> str:
    """Return the notebook that teaches a requirement, such as "05"."""
    return requirement.section.partition("_")[0]
