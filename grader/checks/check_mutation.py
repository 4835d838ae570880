"""T3: whether the package's own tests notice mutants, copies of its source with one fault put in."""

from grader.checks.judge import Failed, Judge, NotReached, Unjudged
from grader.evidence import Mutant, Mutation, short_name
from grader.words import mark, say, some

NEEDS = ("student tests", "mutation", "what ran")
# One line of points from 10 to 75 %, cut in the middle: the core points come first, the advanced ones on top of them.
_NONE, _MIDDLE, _FULL = 10.0, 42.5, 75.0
_LISTED = 8
_CONVICTED = mark(
    "{names} failed each time a line was rewritten without changing what the package does{change}. A test that fails "
    "on any change of the source does not show that it finds mistakes"
)


def test_mutants_are_noticed(judge: Judge) -> None:
    """The package's own tests notice mutants of its source: no points at 10 %, these points at 42.5 %."""
    _share(judge, _NONE, _MIDDLE)


def test_most_mutants_are_noticed(judge: Judge) -> None:
    """The package's own tests notice most mutants of its source: none of these points at 42.5 %, all at 75 %."""
    _share(judge, _MIDDLE, _FULL)


def _share(judge: Judge, none: float, full: float) -> None:
    mutation, measured = _mutation(judge), judge.measured()
    counting = (mutant for mutant in mutation.mutants if measured.covers(mutant.path, mutant.line))
    judged = [mutant for mutant in counting if mutant.outcome != "not tried"]
    noticed = [mutant for mutant in judged if mutant.outcome == "noticed"]
    if not judged:
        raise NotReached(say("the package's source has no line that can be mutated"))
    # Whole tenths of a percent, so that the last digit of a float never decides a point.
    percent = round(100 * len(noticed) / len(judged), 1)
    share = (percent - none) / (full - none)
    words = mark("{n} of {m} mutants were noticed, {percent:g} %")
    seen = "; ".join([say(words, n=len(noticed), m=len(judged), percent=percent), *_notes(mutation)])
    if share >= 1:
        judge.remark(seen)
    else:
        try_ = say("for each line listed, write down what would go wrong, and a test that asserts that it does not")
        judge.share(share, "\n".join([seen, *_unnoticed(judged)]), try_)


def _mutation(judge: Judge) -> Mutation:
    tests = judge.student_tests()
    if not any(module.passed for module in tests.modules):
        said = say("none of the package's own tests passed, so none could notice anything")
        raise NotReached(said, *judge.judged_by("check_student_tests"))
    mutation = judge.evidence.mutation
    if mutation is None:
        raise Unjudged("the package was not mutated")
    if mutation.convicted:
        failed = next((mutant for mutant in mutation.equivalent_mutants if mutant.failed), None)
        change = f" ({failed.path}:{failed.line}, {failed.words})" if failed else ""
        seen = say(_CONVICTED, names=some([*map(short_name, mutation.convicted)], 3), change=change)
        raise Failed(seen, say("assert values returned, messages published, answers given, not how the source looks"))
    return mutation


def _notes(mutation: Mutation) -> list[str]:
    notes = [mutation.note] if mutation.note else []
    if mutation.set_aside:
        names = some([*map(short_name, mutation.set_aside)], 3)
        notes.append(say("{names} passed or failed at random and did not count", names=names))
    return notes


def _unnoticed(mutants: list[Mutant]) -> list[str]:
    """Return a line for each mutant that no test noticed: its place, its change, and the tests that passed on it."""
    missed = [mutant for mutant in mutants if mutant.outcome in ("unnoticed", "unreached")]
    missed.sort(key=lambda mutant: (mutant.outcome == "unreached", mutant.path, mutant.line))
    more = [say("and {left} more", left=len(missed) - _LISTED)] if len(missed) > _LISTED else []
    return [*map(_line, missed[:_LISTED]), *more]


def _line(m: Mutant) -> str:
    if m.outcome == "unreached":
        return say("{m.path}:{m.line} {m.words}: no test reaches this line", m=m)
    names = some([*map(short_name, m.tried)], 2)
    return say("{m.path}:{m.line} {m.words}: {names} passed all the same", m=m, names=names)
