"""Choose the package to grade among the candidates, and say why; or refuse with the choices named. Runs nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import PurePosixPath
from typing import Any

from grader.course import Course
from grader.errors import SubmissionError, UsageError
from grader.intake import kinds
from grader.intake.locate import Candidate, Tree
from grader.intake.unpack import content_hash
from grader.sanitize import printable
from grader.words import mark, say, some

_NAMED = 5  # packages named in a sentence


@dataclass(frozen=True)
class Choice:
    """The package to grade, why it was chosen ("because ..."), and the others, each with what it is."""

    package: Candidate
    because: str
    others: tuple[tuple[Candidate, str], ...] = ()


def _criteria(course: Course) -> tuple[tuple[Callable[[Candidate], Any], str], ...]:
    package, topic = course.package, next((name for node in course.nodes.values() for name in node.publishes), "")
    # In this order; the first in which two candidates differ decides. Of packages under other names, what their code
    # does decides, and not which name is more like the assignment's.
    return (
        (lambda c: c.name != package, say("its name is the one that the assignment asks for")),
        (lambda c: not c.modules, say("it has modules of the assignment")),
        (lambda c: not c.nodes, say("it has nodes in Python")),
        (lambda c: c.name.lower().replace("-", "_") != package, say("its name differs in capitals and dashes only")),
        (lambda c: topic.encode() not in c.topics, say("its nodes name {topic}", topic=topic)),
        (lambda c: -len(c.topics), say("its nodes name the most topics and services of the assignment")),
        (lambda c: c.xml is None or bool(c.xml.problem), say("its package.xml can be read")),
        (lambda c: c.folder != c.name, say("its folder bears its name")),
        (lambda c: c.depth, say("it lies the highest")),
        (lambda c: -len(c.modules), say("it has the most modules of the assignment")),
        (lambda c: -len(c.interfaces), say("it has the most interfaces of the assignment")),
    )


def choose(tree: Tree, name: str) -> Choice:
    """Return the package of the submission `name` that is to be graded.

    Like colcon, it does not look for packages inside a package, unless there is no other with nodes in Python.

    Raises:
        SubmissionError: there is none, and the message says what there is instead; or nothing decides between two.
    """
    rank = partial(_rank, tree.course)
    found = {candidate.path: kinds.kind(tree, candidate) for candidate in tree.candidates}
    outer = [c for c in tree.candidates if not found[c.path] and not _hidden(c, found)]
    inner = [c for c in tree.candidates if not found[c.path]]
    bare = [c for c in tree.candidates if found[c.path] == kinds.BARE]
    pool = next((each for each in (outer, inner, bare) if each), [])
    if not pool:
        what, advice = kinds.describe_instead(tree)
        raise SubmissionError(f"{printable(name)} {what}", advice)
    best = min(pool, key=rank)
    rivals = [c for c in pool if c is not best]
    ties = [c for c in rivals if c.name == best.name and rank(c)[:-1] == rank(best)[:-1] and not _same(tree, c, best)]
    if ties:
        paths = ", ".join(printable(candidate.path) for candidate in (best, *ties)[:_NAMED])
        raise SubmissionError(
            say(
                "{name} holds the package {package} {times} times, each time with other content, and nothing tells "
                "which is meant: {paths}.",
                name=printable(name),
                package=best.name,
                times=len(ties) + 1,
                paths=paths,
            ),
            say("Hand in one of them, or choose with `grader grade --package-path PATH`."),
        )
    others = tuple((c, _remark(c, found[c.path])) for c in sorted(tree.candidates, key=rank) if c is not best)
    return Choice(best, _reason(tree.course, best, rivals, others=bool(others)), others)


def choose_named(tree: Tree, name: str, path: str) -> Choice:
    """Return the package at `path`, whatever it is, of the submission `name`.

    Raises:
        UsageError: there is no package at `path`; the message says where there are some.
    """
    rank = partial(_rank, tree.course)
    chosen = find_named(tree, path)
    if chosen is None:
        paths = [printable(candidate.path) for candidate in sorted(tree.candidates, key=rank)]
        words = mark("There is no package at {path} in {name}.")
        raise UsageError(
            say(words, path=printable(path), name=printable(name)),
            say("It has packages at {paths}.", paths=some(paths, _NAMED))
            if paths
            else say("It holds no package at all."),
        )
    others = tuple((c, _remark(c, kinds.kind(tree, c))) for c in sorted(tree.candidates, key=rank) if c is not chosen)
    return Choice(chosen, say("`--package-path` names it"), others)


def find_named(tree: Tree, path: str) -> Candidate | None:
    """Return the candidate at `path`, the folder or its package.xml; None if there is none."""
    wanted = PurePosixPath(path.removesuffix("package.xml") or ".").as_posix()
    return next((candidate for candidate in tree.candidates if candidate.path == wanted), None)


def interfaces_beside(tree: Tree, package: Candidate) -> Candidate | None:
    """Return the package of the interfaces if the submission has split them off; the nearest if there are several.

    It may have any name if it has interfaces of the contract that the package itself has not, and no nodes.
    """
    rank = partial(_rank, tree.course)
    names = (tree.course.interfaces_package, f"{package.name}_interfaces")
    found = [c for c in tree.candidates if c.xml is not None and c != package]
    split = [
        c for c in found if c.name in names or (c.interfaces - package.interfaces and not c.modules and not c.nodes)
    ]
    return min(
        split, key=lambda c: (c.name not in names, _parent(c.path) != _parent(package.path), rank(c)), default=None
    )


def _rank(course: Course, candidate: Candidate) -> tuple[Any, ...]:
    """Return the sort key of candidates; the smallest is the package."""
    return (*(criterion(candidate) for criterion, _ in _criteria(course)), candidate.path)


def _hidden(candidate: Candidate, found: dict[str, str]) -> bool:
    """Return whether a package lies inside one that can be graded."""
    inside = {parent.as_posix() for parent in PurePosixPath(candidate.path).parents} - {candidate.path}
    return any(not which and path in inside for path, which in found.items())


def _same(tree: Tree, one: Candidate, other: Candidate) -> bool:
    return candidate_hash(tree, one) == candidate_hash(tree, other)


def candidate_hash(tree: Tree, candidate: Candidate) -> str:
    """Return the hash of a candidate's files, the same for every copy of it."""
    folder = PurePosixPath(candidate.path)
    return content_hash(
        tree.root / folder, [PurePosixPath(path).relative_to(folder).as_posix() for path in candidate.files]
    )


def _reason(course: Course, best: Candidate, rivals: Sequence[Candidate], *, others: bool) -> str:
    if not rivals:
        only = mark("it is the only ROS 2 Python package that colcon finds")
        return say(only) if others else say("it is the only package")
    second = min(rivals, key=partial(_rank, course))
    deciding = (words for criterion, words in _criteria(course) if criterion(best) != criterion(second))
    same = second.name == best.name
    return next(deciding, say("the other is the same, file by file") if same else say("its path comes first"))


def _remark(candidate: Candidate, which: str) -> str:
    """Return where a package is that was not chosen, its name, and what else is to be known of it."""
    remarks = [candidate.name, *([say(which)] if which else [])]
    if candidate.inside:
        remarks.append(say("inside {package}, where colcon does not look", package=printable(candidate.inside)))
    return f"{printable(candidate.path)} ({'; '.join(remarks)})"


def _parent(path: str) -> str:
    return PurePosixPath(path).parent.as_posix()
