"""Q4: habits that hurt in a node."""

from collections.abc import Sequence

from grader.checks.judge import Judge
from grader.checks.package_text import charge, label, measured, public_definitions, readable, share_read, weighed
from grader.checks.wording import listing
from grader.evidence import Finding
from grader.words import MOST_SHOWN, say

NEEDS = ("quality", "linters", "what ran")


def test_no_bare_except_print_or_mutable_default(judge: Judge) -> None:
    """No bare `except`, no `print` in the package's modules, no mutable default; each one costs a quarter."""
    bad = _habits(judge, "bare-except", "print", "mutable-default")
    try_ = say("name the exception; use self.get_logger(); use None as the default")
    charge(judge, len(bad), 4, [listing(bad)], try_)


def test_callbacks_do_not_sleep(judge: Judge) -> None:
    """No `time.sleep` in a callback, nor in a function of the package that a callback calls; each one costs half."""
    bad = _habits(judge, "sleep-in-callback")
    charge(judge, len(bad), 2, [listing(bad)], say("let a timer do the next step, and await a future in the action"))


def test_contract_numbers_are_parameters(judge: Judge) -> None:
    """The numbers that the contract names as parameters are declared as parameters and read from them."""
    expect_parameters(judge, [])


def expect_parameters(judge: Judge, without_effect: Sequence[tuple[str, str]]) -> None:
    """Give the share of the contract's parameters that the code declares and reads, and that have an effect.

    `without_effect` has the name of each that a trial has found to have none, and what was seen.
    """
    uses = readable(judge).parameters
    bad = []
    for use in uses:
        if not use.declared:
            bad.append(say("{use.node}: {use.name} is not declared in the code", use=use))
        elif not use.read:
            bad.append(say("{use.node}: {use.name} is declared, and its value is never used", use=use))
    named = " ".join(bad)
    bad += [seen for name, seen in without_effect if name not in named]
    if bad:
        try_ = say("self.declare_parameter('name', default), then self.get_parameter('name').value where it counts")
        judge.share(1 - len(bad) / len(uses), "\n".join(bad), try_)


def test_public_functions_are_annotated(judge: Judge) -> None:
    """Public functions have type annotations for every parameter and for the return value."""
    functions = [thing for thing in public_definitions(judge) if thing.kind == "function"]
    try_ = say("move the work of the callbacks into functions")
    judge.expect(bool(functions), say("there is no public function"), try_)
    bare = [thing for thing in functions if thing.unannotated]
    shown = [f"{label(thing)}: {', '.join(thing.unannotated[:6])}" for thing in bare[:MOST_SHOWN]]
    said = [say("{n} of {n2} lack annotations", n=len(bare), n2=len(functions)), *shown] if bare else []
    try_ = say("def nearest(ranges: Sequence[float], limit: float) -> float")
    share_read(judge, 1 - len(bare) / len(functions), said, try_)


def _habits(judge: Judge, *rules: str) -> list[Finding]:
    return [finding for finding in measured(judge, weighed(judge).habits) if finding.rule in rules]
