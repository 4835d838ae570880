"""Choose the package to grade among the candidates, and say why; or refuse with the choices named. Runs nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePosixPath

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


def choose(tree: Tree, name: str) -> Choice:
    """Return the package of the submission `name` that is to be graded.

    It is that of the assignment's name, else the only one with modules of the assignment, else the only one. Like
    colcon, it does not look for packages inside a package, unless there is no other with nodes in Python.

    Raises:
        SubmissionError: there is none, and the message says what there is instead; or there are several.
    """
    found = {candidate.path: kinds.kind(tree, candidate) for candidate in tree.candidates}
    outer = [c for c in tree.candidates if not found[c.path] and not _hidden(c, found)]
    inner = [c for c in tree.candidates if not found[c.path]]
    bare = [c for c in tree.candidates if found[c.path] == kinds.BARE]
    pool = next((each for each in (outer, inner, bare) if each), [])
    if not pool:
        what, advice = kinds.describe_instead(tree)
        raise SubmissionError(f"{printable(name)} {what}", advice)
    several = len(tree.candidates) > 1
    because = say("it is the only ROS 2 Python package that colcon finds") if several else say("it is the only package")
    named, ours = [c for c in pool if c.name == tree.course.package], [c for c in pool if c.modules]
    if len(pool) > 1 and named:
        pool, because = named, say("its name is the one that the assignment asks for")
        ours = [c for c in named if c.modules]
    if len(pool) > 1 and ours and len(ours) < len(pool):
        pool, because = ours, say("it is the only one with modules of the assignment")
    if len(pool) > 1 and len({candidate_hash(tree, candidate) for candidate in pool}) > 1:
        paths = some([f"{printable(c.path)} ({c.name})" for c in pool], _NAMED)
        words = mark("{name} holds {count} packages, and nothing tells which is meant: {paths}.")
        raise SubmissionError(
            say(words, name=printable(name), count=len(pool), paths=paths),
            say(
                "Hand in one of them, or choose with `grader grade --package-path PATH`; in a class `package: PATH` "
                "in overrides.yaml chooses. `grader batch` grades the packages of several people."
            ),
        )
    if len(pool) > 1:
        because = say("the other is the same, file by file")
    chosen = min(pool, key=lambda candidate: (candidate.path.count("/"), candidate.path))
    return Choice(chosen, because, _others(tree, chosen))


def choose_named(tree: Tree, name: str, path: str) -> Choice:
    """Return the package at `path`, whatever it is, of the submission `name`.

    Raises:
        UsageError: there is no package at `path`; the message says where there are some.
    """
    chosen = find_named(tree, path)
    if chosen is None:
        paths = [printable(candidate.path) for candidate in tree.candidates]
        words = mark("There is no package at {path} in {name}.")
        raise UsageError(
            say(words, path=printable(path), name=printable(name)),
            say("It has packages at {paths}.", paths=some(paths, _NAMED))
            if paths
            else say("It holds no package at all."),
        )
    return Choice(chosen, say("`--package-path` names it"), _others(tree, chosen))


def _others(tree: Tree, chosen: Candidate) -> tuple[tuple[Candidate, str], ...]:
    """Return the packages that were not chosen, each with where it is, its name, and what else is to be known of it."""
    return tuple((c, _remark(c, kinds.kind(tree, c))) for c in tree.candidates if c is not chosen)


def find_named(tree: Tree, path: str) -> Candidate | None:
    """Return the candidate at `path`, the folder or its package.xml; None if there is none."""
    wanted = PurePosixPath(path.removesuffix("package.xml") or ".").as_posix()
    return next((candidate for candidate in tree.candidates if candidate.path == wanted), None)


def interfaces_beside(tree: Tree, package: Candidate) -> Candidate | None:
    """Return the package of the interfaces if the submission has split them off; the nearest if there are several.

    It may have any name if it has interfaces of the contract that the package itself has not, and no nodes.
    """
    names = (tree.course.interfaces_package, f"{package.name}_interfaces")
    found = [c for c in tree.candidates if c.xml is not None and c != package]
    split = [
        c for c in found if c.name in names or (c.interfaces - package.interfaces and not c.modules and not c.nodes)
    ]
    return min(split, key=lambda c: (c.name not in names, _parent(c.path) != _parent(package.path)), default=None)


def _hidden(candidate: Candidate, found: dict[str, str]) -> bool:
    """Return whether a package lies inside one that can be graded."""
    inside = {parent.as_posix() for parent in PurePosixPath(candidate.path).parents} - {candidate.path}
    return any(not which and path in inside for path, which in found.items())


def candidate_hash(tree: Tree, candidate: Candidate) -> str:
    """Return the hash of a candidate's files, the same for every copy of it."""
    folder = PurePosixPath(candidate.path)
    return content_hash(
        tree.root / folder, [PurePosixPath(path).relative_to(folder).as_posix() for path in candidate.files]
    )


def _remark(candidate: Candidate, which: str) -> str:
    remarks = [candidate.name, *([say(which)] if which else [])]
    if candidate.inside:
        remarks.append(say("inside {package}, where colcon does not look", package=printable(candidate.inside)))
    return f"{printable(candidate.path)} ({'; '.join(remarks)})"


def _parent(path: str) -> str:
    return PurePosixPath(path).parent.as_posix()
