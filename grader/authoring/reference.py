"""Write docs/own-course-reference.md from the docstrings of what a course's trials and checks work with.

python -m grader.authoring.reference
"""

from __future__ import annotations

import ast
import inspect
import re

from grader import KIT

PAGE = KIT / "docs" / "own-course-reference.md"
_HEAD = """\
# What trials and checks work with

Written by `python -m grader.authoring.reference` from the docstrings; do not edit by hand.
How to make a course is in [own-course.md](own-course.md).
Times are simulated seconds since the trial began, lengths metres, angles radians, counter-clockwise positive.
"""
_OF_TRIALS = (
    "Trial", "Command", "Sample", "ScanSummary", "Touch", "Call", "Goal", "Message", "ParameterAnswer", "ProcessEnd",
    "Graph", "Endpoint",
)  # fmt: skip
OF_THE_ENGINE = ("open", "facts", "close")
"""What the engine asks of a stage, not a script."""
_NO_OPTIONS = re.compile(r"(?m)^- `(?:sentence|script|kind)`: .*\n")


def page() -> str:
    """Return the text of the page."""
    stage = {name: part for name, part in public("trials/stage.py", "Stage").items() if name not in OF_THE_ENGINE}
    return "".join((
        f"{_HEAD}\n## The options of `@trial`\n{_NO_OPTIONS.sub('', words(_class('trials/plan.py', 'TrialPlan')))}",
        "\n## `stage`, in a trial\n",
        *map(_method, stage.values()),
        "\n## What a trial has recorded\n",
        *(f"\n### {name}\n{words(_class('evidence/trial.py', name))}\n{_fields(name)}" for name in _OF_TRIALS),
        f"\n## `judge`, in a check\n{words(_class('checks/judge.py', 'Judge'))}",
        *map(_method, public("checks/judge.py", "Judge").values()),
        "\n## What a check may raise\n",
        *(f"\n### {name}\n{words(_class('checks/judge.py', name))}" for name in ("Failed", "NotReached", "Unjudged")),
    ))  # fmt: skip


def public(file: str, class_: str) -> dict[str, ast.FunctionDef]:
    """Return the public methods and properties of a class in a file of `grader/`, by their names."""
    body = _class(file, class_).body
    return {part.name: part for part in body if isinstance(part, ast.FunctionDef) and part.name[0] != "_"}


def _class(file: str, name: str) -> ast.ClassDef:
    tree = ast.parse((KIT / "grader" / file).read_text(encoding="utf-8"))
    return next(part for part in tree.body if isinstance(part, ast.ClassDef) and part.name == name)


def _fields(name: str) -> str:
    """Return a list of the fields of a fact about a trial: their types, and what the docstrings below them say."""
    found = ""
    for part in _class("evidence/trial.py", name).body:
        match part:
            case ast.AnnAssign():
                found += f"\n- `{ast.unparse(part.target)}: {ast.unparse(part.annotation)}`"
            case ast.Expr(ast.Constant(str(words))) if found:
                found += f" {words}"
    return found.removeprefix("\n") + "\n" * bool(found)


def _method(method: ast.FunctionDef) -> str:
    """Return what "`run(seconds: float)`" does; of a property there is the name alone."""
    arguments = ast.unparse(method.args).removeprefix("self").removeprefix(", ")
    return f"\n### `{method.name}{'' if method.decorator_list else f'({arguments})'}`\n{words(method)}"


def words(part: ast.ClassDef | ast.FunctionDef) -> str:
    """Return a docstring as Markdown: a list of attributes or errors as a list."""
    text = inspect.cleandoc(ast.get_docstring(part) or "")
    text = re.sub(r"(?m)^(Args|Attributes|Raises):\n", r"\1:\n\n", text)
    text = re.sub(r"(?m)^    (\w+): ", r"- `\1`: ", text)
    return f"\n{re.sub(r'(?m)^ {8}', '  ', text)}\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
