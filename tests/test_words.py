"""What students read comes from catalogues, and the German one lacks nothing."""

from __future__ import annotations

import ast
import gettext
import html
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from string import Formatter

import pytest
from helpers import judging, messages, recordings
from helpers.course import COURSE

from grader import KIT, words
from grader.checks.judge import Unjudged
from grader.course import handout
from grader.evidence import Evidence, to_json
from grader.report import console
from grader.report import html as page
from grader.scoring import rubric
from grader.scoring.grading import Grading, points
from grader.scoring.scorecard import CheckResult, Outcome, score
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
        texts, strings = messages.several(message.id), messages.several(message.string)
        wanted = set().union(*map(messages.fields, texts))
        assert not message.id or all(messages.fields(text) == wanted for text in strings), message.id


def test_each_text_is_said_with_its_fields():
    """A field that is not given would fail where the text is said, perhaps in a rare case."""
    wrong = []
    for path in code():
        for call, texts in messages.said(ast.parse(path.read_text(encoding="utf-8"))):
            given = {keyword.arg for keyword in call.keywords} | ({"n"} if isinstance(texts, tuple) else set())
            named = (name for text in messages.several(texts) for name in messages.fields(text))
            wanted = {name.partition(".")[0].partition("[")[0] for name in named}
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
    assert say("{1} and {") == "{1} and {"
    assert say("") == ""


@pytest.mark.usefixtures("german")
def test_a_number_in_prose_has_a_decimal_comma_and_one_in_code_a_point():
    assert say("no answer within {seconds:g} s", seconds=2.5) == "keine Antwort innerhalb von 2,5 s"
    assert say("`sleep({s!s})`", s=2.5) == "`sleep(2.5)`"
    assert points(2.5) == "2,5"


@pytest.mark.usefixtures("german")
def test_german_has_its_own_plural():
    assert [say_count("{n} trial", "{n} trials", n) for n in (0, 1, 2)] == ["0 Versuche", "1 Versuch", "2 Versuche"]


class Veiled(gettext.NullTranslations):
    """A language in which the letters of every text from the catalogue are dots; fields and tags stay."""

    def gettext(self, text: str) -> str:
        parts = re.split(r"(%\(\w+\)s|<[^>]*>|\{\{.*?\}\}|\{%.*?%\}|\{#.*?#\})", text)
        return "".join(part if place % 2 else _veiled(part) for place, part in enumerate(parts))

    def ngettext(self, one: str, many: str, n: int) -> str:  # noqa: ARG002
        return self.gettext(many)


def _veiled(text: str) -> str:
    dots = lambda literal: re.sub(r"[A-Za-zäöü]", "·", literal)  # noqa: E731
    if not messages.fields(text):
        return dots(text)
    made = ""
    for literal, name, spec, conversion in Formatter().parse(text):
        made += dots(literal).replace("{", "{{").replace("}", "}}")
        made += f"{{{name}{f'!{conversion}' if conversion else ''}{f':{spec}' if spec else ''}}}" if name else ""
    return made


@pytest.fixture
def veiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(words, "_spoken", words._Language("xx", Veiled(), ","))


def judged(evidence: Evidence) -> Grading:
    """Return the grading of a recording, without what its evidence does not suffice for."""
    whole = rubric.load(COURSE.rubric)
    results = []
    for check in whole.checks:
        function = judging.find(check.id)
        sentence = say(" ".join((function.__doc__ or "").split()))
        result = CheckResult(check.id, Outcome.PASSED, 1.0, sentence, expected=sentence)
        try:
            found = judging.ask(function, evidence)
        except Unjudged:
            results.append(result)
            continue
        outcome = Outcome.PASSED if found.share >= 1 else Outcome.FAILED if found.reached else Outcome.NOT_REACHED
        seen, because = (say(found.seen), "") if found.reached else ("", found.seen)
        results.append(
            replace(result, outcome=outcome, fraction=found.share, seen=seen, try_=say(found.try_), because=because)
        )
    return Grading(
        score(whole, results), evidence, {}, "team07.zip", seed=0, wall_seconds=1.0, rubric_title=whole.title
    )


def english_in(text: str, allowed: str) -> list[str]:
    """Return what has two words in sequence that are neither from the catalogue nor from what is allowed."""
    runs = re.findall(r"[A-Za-z]{2,}(?:['’]s)?(?:,? [A-Za-z]{2,}(?:['’]s)?)+", " ".join(text.split()))
    return sorted({run for run in runs if run not in allowed})


def visible(markup: str) -> str:
    shown = re.sub(r"<(style|script|pre)\b.*?</\1>", " ", markup, flags=re.DOTALL)
    spoken = re.findall(r'(?:alt|aria-label|data-label|data-play|data-ahead)="([^"]*)"', shown)
    return html.unescape(" ".join([re.sub(r"<[^>]*>", " | ", shown), *spoken]))


@pytest.mark.usefixtures("veiled")
@pytest.mark.parametrize("name", ["reference", "drives_into_the_wall", "does_not_compile", "has_a_failing_test"])
def test_a_report_has_no_fixed_sentence_beside_the_catalogue(name: str):
    evidence = recordings.load(name)
    grading = judged(evidence)
    sections = " ".join(requirement.section for requirement in rubric.load(COURSE.rubric).requirements)
    allowed = " ".join(f"{to_json(evidence)} {sections}".replace("\\n", " ").split())
    assert not english_in(visible(page.render(grading)), allowed)
    assert not english_in(console.render(grading, width=100_000), allowed)


@pytest.mark.usefixtures("veiled")
def test_the_handout_has_no_fixed_sentence_beside_the_catalogue():
    fields = " ".join(handout.fields(path.read_text()) for path in COURSE.contract.rglob("*.*"))
    text = re.sub("<!--.*?-->", "", handout.render(rubric.load(COURSE.rubric), COURSE))
    assert not english_in(text, " ".join(fields.split()))


@pytest.mark.usefixtures("german")
def test_the_report_of_a_german_course_says_so_in_german():
    markup = page.render(judged(recordings.load("drives_into_the_wall")))
    assert '<html lang="de">' in markup
    assert "berührte „circle 1“ bei 7,33 s mit 0,30 m/s" in html.unescape(markup)
