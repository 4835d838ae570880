"""What students read comes from catalogues, and the German one lacks nothing."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers import messages
from helpers.course import COURSE

from grader import KIT, words
from grader.scoring.grading import points
from grader.words import say, say_count


@pytest.fixture
def german() -> Iterator[None]:
    words.speak("de", COURSE.folder)
    yield
    words.speak("en", COURSE.folder)


def code() -> list[Path]:
    return [
        path for path in (KIT / "grader").rglob("*.py") if "authoring" not in path.parts and "ros2" not in path.parts
    ]


@pytest.mark.parametrize("whose", messages.CATALOGUES)
def test_german_lacks_no_message(whose: str):
    catalogue = messages.catalogue(whose)
    known = {message.id: message.string for message in catalogue if message.id}
    wanted = [text for text, _ in messages.messages(whose)]
    lacking = [text for text in wanted if not known.get(text) or not all(known[text])]
    assert not lacking, "`make words` adds these to the catalogue; translate them"
    assert not known.keys() - set(wanted), "`make words` takes these out"


@pytest.mark.parametrize("whose", messages.CATALOGUES)
def test_a_translation_has_the_fields_of_its_message(whose: str):
    for message in messages.catalogue(whose):
        texts = message.id if isinstance(message.id, tuple) else (message.id,)
        wanted = set().union(*map(messages.fields, texts))
        strings = message.string if isinstance(message.string, tuple) else (message.string,)
        assert not message.id or all(messages.fields(text) == wanted for text in strings), message.id


def test_each_text_is_said_with_its_fields():
    """A field that is not given would fail where the text is said, perhaps in a rare case."""
    wrong = []
    for path in code():
        for call, texts in messages.said(ast.parse(path.read_text(encoding="utf-8"))):
            given = {keyword.arg for keyword in call.keywords} | ({"n"} if isinstance(texts, tuple) else set())
            texts = texts if isinstance(texts, tuple) else (texts,)
            wanted = {name.partition(".")[0].partition("[")[0] for text in texts for name in messages.fields(text)}
            if given and None not in given and isinstance(call.func, ast.Name) and call.func.id != "mark":
                wrong += [f"{path.name}:{call.lineno}"] if given - {"n"} != wanted - {"n"} else []
    assert not wrong


def test_nothing_is_said_when_a_module_is_loaded():
    """The language is not chosen yet: mark the text there, and say it where it is used."""

    def at_once(node: ast.AST) -> Iterator[int]:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id.startswith("say"):
            yield node.lineno
        for child in ast.iter_child_nodes(node):
            if not isinstance(child, ast.FunctionDef | ast.Lambda):
                yield from at_once(child)

    found = {path.name: [*at_once(ast.parse(path.read_text(encoding="utf-8")))] for path in code()}
    assert not {name: lines for name, lines in found.items() if lines}


def test_english_is_what_the_code_says():
    assert say("no {topic} came", topic="scan") == "no scan came"
    assert (
        say(
            "{1} and {",
        )
        == "{1} and {"
    )
    assert say("") == ""


@pytest.mark.usefixtures("german")
def test_a_number_in_prose_has_a_decimal_comma_and_one_in_code_a_point():
    assert say("no answer within {seconds:g} s", seconds=2.5) == "keine Antwort innerhalb von 2,5 s"
    assert say("`sleep({s!s})`", s=2.5) == "`sleep(2.5)`"
    assert points(2.5) == "2,5"


@pytest.mark.usefixtures("german")
def test_german_has_its_own_plural():
    assert [say_count("{n} trial", "{n} trials", n) for n in (0, 1, 2)] == ["0 Versuche", "1 Versuch", "2 Versuche"]


@pytest.mark.usefixtures("german")
def test_a_text_without_a_translation_stays_as_it_is():
    assert say("eigener Satz einer Kursleiterin mit {x}", x=1) == "eigener Satz einer Kursleiterin mit 1"
