"""Q1: ament_flake8's rules."""

from grader.checks.judge import Judge
from grader.checks.package_text import measured, readable_first, unread_files, weighed
from grader.checks.wording import listing
from grader.evidence import reading_limits
from grader.words import MOST_SHOWN, mark, say, say_count, some

NEEDS = ("quality", "linters", "what ran")


def test_ament_flake8_finds_nothing(judge: Judge) -> None:
    """ament_flake8 finds nothing: full marks for no finding, none for 1 per 10 lines of code or more."""
    quality = weighed(judge)
    found, broken = measured(judge, quality.style), unread_files(judge)
    # A file that the linter cannot read is no better than code with a finding on every tenth line. Where Python runs
    # what the linter is kept from, it may be the worst code, so that nobody gains by making a bad module larger.
    hidden = [file.lines if reading_limits.runs_unread(file) else file.lines / 10 for file in broken]
    count = len(found) + sum(max(1.0, lines) for lines in hidden)
    lines = judge.measured().lines(quality.files)
    beside = _idle(judge)
    if not count:
        judge.share(1.0, beside, "")
        return
    said = say_count(
        "{n} finding in {lines} lines of code", "{n} findings in {lines} lines of code", len(found), lines=lines
    )
    unread = [f"{file.path} {file.problem}" for file in broken[:MOST_SHOWN]]
    seen = "\n".join([*([said, listing(found)] if found else []), *unread, *filter(None, [beside])])
    try_ = say("run `ament_flake8` in the package's folder; it reports the same")
    judge.share(1 - 10 * count / max(1, lines), seen, readable_first(broken, try_))


def _idle(judge: Judge) -> str:
    """Return which files of the package do not count because nothing of them ran."""
    idle = judge.measured().idle if judge.measured().by_notes else []
    words = mark("of these files nothing ran, so they neither earn nor cost: {names}")
    return say(words, names=some(idle, 5)) if idle else ""
