"""T3: faults put into the package's own source, and whether its own tests notice."""

from grader.checks.judge import Judge, NotReached
from grader.evidence import Mutant, Mutation, short_name

# One line of points from 10 to 75 %, cut in the middle: the core points come first, the advanced ones on top of them.
_NONE, _MIDDLE, _FULL = 10.0, 42.5, 75.0
_LISTED = 8


def test_mutants_are_noticed(judge: Judge) -> None:
    """Faults put into the package's source are noticed by its own tests: none at 10 %, these points at 42.5 %."""
    _share(judge, _NONE, _MIDDLE)


def test_most_faults_are_noticed(judge: Judge) -> None:
    """Most faults put into the package's source are noticed by its own tests: none at 42.5 %, full at 75 %."""
    _share(judge, _MIDDLE, _FULL)


def _share(judge: Judge, none: float, full: float) -> None:
    mutation = _mutation(judge)
    judged = [fault for fault in mutation.mutants if fault.outcome != "not tried"]
    noticed = [fault for fault in judged if fault.outcome == "noticed"]
    if not judged:
        raise NotReached("there is nothing in the package's source to put a fault into")
    # Whole tenths of a percent, so that the last digit of a float never decides a point.
    percent = round(100 * len(noticed) / len(judged), 1)
    share = (percent - none) / (full - none)
    if share < 1:
        seen = f"{len(noticed)} of {len(judged)} faults were noticed, {percent:g} %" + _notes(mutation)
        advice = "for each line listed, write down what would go wrong, then a test that asserts it does not"
        judge.share(share, "\n".join([seen, *_unnoticed(judged)]), advice)


def _mutation(judge: Judge) -> Mutation:
    judge.built()
    tests = judge.evidence.tests
    if tests is None:
        raise RuntimeError("the package's own tests were not run")
    if not any(module.passed for module in tests.modules):
        raise NotReached("no test of the package's own passed, so none could notice anything (T1)")
    judge.expect(
        not tests.doubts,
        f"the reports of these tests cannot be believed: {'; '.join(tests.doubts[:3])}",
        "leave pytest's reports and coverage's data alone; a test that fails is a help",
    )
    mutation = judge.evidence.mutation
    if mutation is None:
        raise RuntimeError("no faults were put into the package")
    judge.expect(
        not mutation.convicted,
        _conviction(mutation),
        "assert what the package does: values returned, messages published, answers given; not how its source looks",
    )
    return mutation


def _conviction(mutation: Mutation) -> str:
    failed = next((decoy for decoy in mutation.equivalent_mutants if decoy.failed), None)
    change = f" ({failed.path}:{failed.line}, {failed.words})" if failed else ""
    names = ", ".join(short_name(name) for name in mutation.convicted[:3])
    return (
        f"{names} failed each time a line was written in another "
        f"way that changes nothing of what the package does{change}: it notices any change of the source, so nothing "
        "it notices says that a fault was found"
    )


def _notes(mutation: Mutation) -> str:
    notes = [mutation.note] if mutation.note else []
    if mutation.set_aside:
        names = ", ".join(short_name(name) for name in mutation.set_aside[:3])
        notes.append(f"{names} passed or failed by chance and did not count")
    return "".join(f"; {note}" for note in notes)


def _unnoticed(faults: list[Mutant]) -> list[str]:
    """Return a line for each fault that no test noticed: where, what, and the tests that let it pass."""
    missed = sorted((f for f in faults if f.outcome == "unnoticed"), key=lambda fault: (fault.path, fault.line))
    unreached = sorted((f for f in faults if f.outcome == "unreached"), key=lambda fault: (fault.path, fault.line))
    lines = [f"{fault.path}:{fault.line} {fault.words}: {_passed(fault)}" for fault in missed[:_LISTED]]
    room = _LISTED - len(lines)
    lines += [f"{fault.path}:{fault.line} {fault.words}: no test reaches this line" for fault in unreached[:room]]
    left = len(missed) + len(unreached) - len(lines)
    return lines + ([f"and {left} more"] if left else [])


def _passed(fault: Mutant) -> str:
    names = [short_name(name) for name in fault.tried]
    shown = ", ".join(names[:2])
    return (
        f"{shown} passed all the same" if len(names) < 3 else f"{shown} and {len(names) - 2} more passed all the same"
    )
