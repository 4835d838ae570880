"""Collect what students read from code, templates and rubrics, and bring the catalogues up to date: `make words`.

The engine's messages go into grader/locale, those of the kit's own course into the folder `words` of the course.
"""

from __future__ import annotations

import ast
import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Formatter
from typing import Any

import yaml
from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po
from jinja2.ext import babel_extract

from grader import KIT, words
from helpers.course import COURSE

ENGINE = KIT / "grader"
OWN = COURSE.folder
LANGUAGE = "de"
CATALOGUES = {
    "engine": words.LOCALE / LANGUAGE / "LC_MESSAGES" / "grader.po",
    "course": OWN / "words" / f"{LANGUAGE}.po",
}
_HEADER = re.compile(r"\"(?!Language:|Plural-Forms|Content-)[A-Z][A-Za-z-]+: ")
Message = tuple[str | tuple[str, str], str]
"""A text, or one for a single thing and one for many, and the file that it is in."""


def messages(whose: str) -> list[Message]:
    """Return the messages of the engine or of the course, in the order of the files, each once."""
    root = ENGINE if whose == "engine" else OWN
    left_out = [ENGINE / "courses", ENGINE / "authoring", ENGINE / "ros2"] if whose == "engine" else []
    files = [path for path in sorted(root.rglob("*")) if not any(map(path.is_relative_to, left_out))]
    found = [(text, path) for path in files for text in _of_file(path)]
    if whose == "course":
        found += [(text, COURSE.rubric) for text in _of_rubric(COURSE.rubric)]
        table = COURSE.notebook_table
        rows = [*table["later"].values(), *table["stand_ins"].values()]
        found += [(row["words"], OWN / "notebooks.yaml") for row in rows]
    return list({text: (text, path.relative_to(KIT).as_posix()) for text, path in reversed(found)}.values())[::-1]


def _of_file(path: Path) -> Iterator[str | tuple[str, str]]:
    if path.suffix == ".py":
        yield from (text for _, text in said(ast.parse(path.read_text(encoding="utf-8"))))
        if path.stem.startswith("check_") and path.parent.name == "checks":
            yield from _sentences(path)
        if path.parent.name == "hunts":
            yield from _promises(path)
    elif path.name == "handout.md.j2":
        yield from filter(_is_prose, path.read_text(encoding="utf-8").splitlines())
    elif path.suffix == ".j2" and "classroom" not in path.parts:
        options = {"trim_blocks": "true", "lstrip_blocks": "true", "newstyle_gettext": "true"}
        with path.open("rb") as stream:
            for _, _, text, _ in babel_extract(stream, ("_", "gettext"), (), options):
                if isinstance(text, str) or (text and isinstance(text[0], str)):
                    yield text if isinstance(text, str) else str(text[0])


def said(tree: ast.AST) -> Iterator[tuple[ast.Call, str | tuple[str, str]]]:
    """Yield the calls of `say`, `say_count` and `mark` that have their text in them, with the text."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args:
            texts = [each.value for each in node.args if isinstance(each, ast.Constant) and isinstance(each.value, str)]
            if node.func.id in ("say", "mark") and texts:
                yield node, texts[0]
            elif node.func.id == "say_count":
                yield node, (texts[0], texts[1])


def _sentences(path: Path) -> Iterator[str]:
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield " ".join((ast.get_docstring(node) or "").split())


def _promises(path: Path) -> Iterator[str]:
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef) and any("promise(" in ast.unparse(each) for each in node.decorator_list):
            yield (ast.get_docstring(node) or "").partition("\n")[0]


def _is_prose(line: str) -> bool:
    """Return whether a line of the handout's frame has words beside code and Jinja."""
    return re.search(r"[A-Za-z]{3,}", re.sub(r"\{\{.*?\}\}|\{%.*?%\}|\{#.*#\}|`[^`]*`", "", line)) is not None


def _of_rubric(path: Path) -> Iterator[str]:
    whole = yaml.safe_load(path.read_text(encoding="utf-8"))
    texts = [whole["title"]]
    for criterion in whole["criteria"]:
        texts += [criterion["title"], *criterion["levels"].values()]
        texts += [each[name] for each in criterion["requirements"] for name in ("title", "text") if name in each]
    yield from (" ".join(text.split()) for text in texts)


def several(texts: str | Sequence[str]) -> tuple[str, ...]:
    """Return the texts of a message, one or two."""
    return (texts,) if isinstance(texts, str) else tuple(texts)


def fields(text: str) -> set[str]:
    """Return the fields of a message, by name and, for a plain number, with how it is shown."""
    braces = {name for _, name, _, _ in Formatter().parse(text) if name} if _has_fields(text) else set()
    return braces | set(re.findall(r"%\(\w+\)s", text))


def _has_fields(text: str) -> bool:
    try:
        return any(name is not None for _, name, _, _ in Formatter().parse(text))
    except ValueError:  # a brace of CMake's or JSON's: a text without fields is not formatted
        return False


def catalogue(whose: str) -> Catalog:
    """Return a catalogue as it is."""
    with CATALOGUES[whose].open("rb") as stream:
        return read_po(stream, locale=LANGUAGE)


def update(whose: str, more: dict[Any, Any] | None = None) -> list[Any]:
    """Write a catalogue with all messages and the translations that there are, and return those without one."""
    path = CATALOGUES[whose]
    old = catalogue(whose) if path.is_file() else Catalog(locale=LANGUAGE)
    new = Catalog(locale=LANGUAGE)
    for text, file in messages(whose):
        known = old.get(text if isinstance(text, str) else text[0])
        string = (more or {}).get(text) or (known.string if known else "")
        new.add(text, string, locations=[(file, 1)])
    path.parent.mkdir(parents=True, exist_ok=True)
    made = io.BytesIO()
    write_po(made, new, width=0, include_lineno=False)
    # Of the header only what reading needs: no dates and no placeholders of people.
    lines = [line for line in made.getvalue().decode().splitlines() if not _HEADER.match(line)]
    path.write_text("\n".join(lines[lines.index('msgid ""') :]) + "\n", encoding="utf-8")
    return [message.id for message in new if message.id and not (message.string and all(message.string))]


if __name__ == "__main__":
    for whose in CATALOGUES:
        for text in update(whose):
            print(f"{CATALOGUES[whose].relative_to(KIT)} has no words for: {text}")
