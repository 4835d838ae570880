"""The league of trials: handed-in cases convict the broken packages of a pool, and leave right ones alone."""

from grader.checks.judge import Judge, NotReached, Unjudged
from grader.evidence import League, LeagueCase
from grader.words import mark, say

NEEDS = ("league",)
_TRY = mark("hunt in a package into which you have put a mistake, and hand in what is found")


def test_broken_packages_are_caught(judge: Judge) -> None:
    """The cases in the package's folder `cases` catch broken packages: points for each of the pool."""
    league = _league(judge)
    caught = {name for case in league.cases if _is_fair(case) for name in case.caught}
    judge.figure("caught", len(caught))
    seen = say("{n} of {m} broken packages caught", n=len(caught), m=league.pool)
    judge.share(len(caught) / league.pool, "\n".join([seen, *map(_line, league.cases)]), say(_TRY))


def test_right_packages_are_left_alone(judge: Judge) -> None:
    """Right packages break no promise in the cases that are handed in, of which one at least catches something."""
    league = _league(judge)
    if not any(case.caught for case in league.cases):
        raise NotReached(say("no case catches a broken package, and one that does nothing leaves all alone"))
    wrong = [case for case in league.cases if not _is_fair(case)]
    share = 1 - len(wrong) / len(league.cases)
    if wrong:
        judge.share(share, "\n".join(map(_line, wrong)), say("run it with `grader hunt --again` on your own package"))


def _league(judge: Judge) -> League:
    league = judge.evidence.league
    if league is None:
        raise Unjudged("the league's packages are not on this machine")
    judge.expect(bool(league.cases), say("no case is handed in: there is no file cases/*.yaml"), say(_TRY))
    return league


def _is_fair(case: LeagueCase) -> bool:
    return not case.problem and not case.unfair


def _line(case: LeagueCase) -> str:
    """Return a line about a case: how many it catches, or why it does not count. It names no package."""
    if case.problem:
        return case.problem if case.path in case.problem else say("{path}: {why}", path=case.path, why=case.problem)
    if case.unfair:
        words = mark("{path} does not count: a right package breaks a promise in it. {promise}")
        return say(words, path=case.path, promise=case.unfair)
    return say("{path} catches {n}", path=case.path, n=len(case.caught))
