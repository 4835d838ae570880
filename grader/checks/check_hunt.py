"""A hunt: the package keeps what its contract promises in made-up cases, all of which it may meet."""

from grader.checks.judge import Failed, Judge, Unjudged
from grader.words import say

NEEDS = ("hunt",)


def test_keeps_its_promises(judge: Judge, requirement: str) -> None:
    """It keeps what it promises in situations that are made up within the contract."""
    judge.require_build()
    hunt = judge.evidence.hunts.get(requirement)
    if hunt is None:
        raise Unjudged(f"there was no hunt for {requirement}")
    if hunt.trial:
        judge.trial(hunt.trial, complete=hunt.broken is None)
    if hunt.broken is None:
        judge.remark(say("{n} cases, no fault found", n=hunt.cases))
        return
    seen = say(
        "{seen}\npromised: {promise}\ncase {n}, made as small as it can be:\n{case}",
        seen=hunt.broken.seen, promise=say(hunt.broken.sentence), n=hunt.cases, case=hunt.broken.case.rstrip(),
    )  # fmt: skip
    raise Failed(seen, say("put the case into a file case.yaml; `grader hunt --again case.yaml` shows it again"))
