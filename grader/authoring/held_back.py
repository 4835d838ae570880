"""Keep what a course holds back out of its students' kit: name what is in the wrong folder, and which file tells of it.

Nothing in held_back/ is released.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

import yaml

from grader.checks import checks_run
from grader.course import Course, reader
from grader.errors import GraderError
from grader.league.source import LeagueCases
from grader.notebook import checkpoints
from grader.scoring import rubric
from grader.scoring.rubric import Rubric
from grader.trials import catalog

_PACKED = checkpoints.PACKED.name


def rubric_for_students(text: str, whole: Rubric, course: Course) -> str:
    """Return the text of a rubric without the checks of requirements that are held back; it has their points.

    Those of a league are judged at hand-in, too, though its report shows them: a student has no package to catch.
    """
    hidden = {r.id for r in whole.requirements if r.held_back} | checks_run.served(course, whole, LeagueCases.name)
    if not hidden:
        return text
    data: dict[str, Any] = yaml.safe_load(text)
    for item in (item for criterion in data["criteria"] for item in criterion["requirements"]):
        requirement = whole.requirement(str(item["id"]))
        if requirement.id in hidden:
            item.pop("checks", None)
            item |= {"points": requirement.points, "advanced": requirement.advanced, "held_back": True}
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=120)


def problems(course: Course) -> list[str]:
    """Return what is in the wrong folder, by what it serves: in held_back/, or outside."""
    whole = rubric.load(course.rubric)
    secret = {requirement.id for requirement in whole.requirements if requirement.held_back}
    return [*_trials(course, secret), *_checks(course, whole)]


def require_apart(course: Course, files: Mapping[str, bytes]) -> None:
    """Check that a course's files in the kit, by their paths, tell nothing of what is held back.

    Raises:
        GraderError: something is in the wrong folder, or a file of the kit names what is held back.
    """
    found = [*problems(course), *_leaks(course, files)]
    if found:
        raise GraderError(f"The kit would show what is held back: {'; '.join(found)}.")


def _trials(course: Course, secret: set[str]) -> Iterator[str]:
    known = reader.held_back_names(course)
    for plan in (plan for plan in catalog.trials(course).values() if plan.serves):
        serves, inside = set(plan.serves), plan.name in known
        place = f"the trial {plan.name} in {'held_back/' if inside else ''}trials/"
        if serves & secret and serves - secret:
            yield f"{place} serves {', '.join(plan.serves)}, of which only some are held back; make two trials of it"
        elif bool(serves & secret) != inside:
            yield f"{place} serves {', '.join(plan.serves)}; {_move(inside, 'trials')}"


def _checks(course: Course, whole: Rubric) -> Iterator[str]:
    files = course.files("checks", "*.py")
    inside = {path.stem for path in files if path.is_relative_to(course.held_back)}
    public = {path.stem for path in files if not path.is_relative_to(course.held_back)}
    for requirement in whole.requirements:
        if requirement.held_back and not requirement.checks:
            yield f"{requirement.id} is held back, and nothing judges it; name its checks in {course.rubric.name}"
        for module in dict.fromkeys(check.module for check in requirement.checks):
            if module in public & inside:
                yield f"{module}.py is in checks/ and in held_back/checks/; rename one of them"
            elif module in (public if requirement.held_back else inside):
                place = f"{'' if requirement.held_back else 'held_back/'}checks/{module}.py"
                yield f"{place} judges {requirement.id}; {_move(module in inside, 'checks')}"


def _move(inside: bool, kind: str) -> str:
    return f"move it to {kind}/, or write `held_back: true`" if inside else f"move it to held_back/{kind}/"


def _leaks(course: Course, files: Mapping[str, bytes]) -> Iterator[str]:
    """Yield which files name what is held back, and which world nothing else in them uses."""
    named = reader.held_back_words(reader.held_back_names(course))
    texts = {name: _text(name, content) for name, content in files.items()}
    for name, text in texts.items():
        if found := named.search(f"{name}\n{text}"):
            yield f"{name} names {found[0]}, which is held back; take it out, or rename one of them"
    used = {plan.world for plan in catalog.trials(course).values() if plan.name in reader.held_back_names(course)}
    for world in sorted(used):
        place = next((name for name in texts if name.endswith(f"worlds/{world}.yaml")), "")
        word = re.compile(rf"(?<!\w){re.escape(world)}(?!\w)")
        if place and not any(word.search(text) for name, text in texts.items() if name != place):
            yield f"only trials that are held back use {place}; move it to held_back/worlds/"


def _text(name: str, content: bytes) -> str:
    """Return a file as text, packed solutions unpacked; of a picture nothing, whose bytes are words by chance."""
    if name.endswith(_PACKED):
        return json.dumps(json.loads(zlib.decompress(content)), ensure_ascii=False)
    return "" if name.endswith(".png") else content.decode(errors="replace")
