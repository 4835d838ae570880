"""Q1: ament_flake8's rules."""

from grader.checks.findings import MOST_SHOWN, listing, place, some
from grader.checks.judge import Judge
from grader.checks.package_text import readable
from grader.evidence import Quality, reading_limits


def test_ament_flake8_finds_nothing(judge: Judge) -> None:
    """ament_flake8 finds nothing: full marks for no finding, none for 1 per 10 lines of code or more."""
    quality = readable(judge)
    broken = [file for file in quality.files if file.problem]
    # A file that the linter cannot read is no better than code with a finding on every tenth line.
    count = quality.style_count + sum(max(1.0, file.lines / 10) for file in broken)
    lines = reading_limits.counted_lines(quality.files)
    suppressed = _suppressed(quality)
    if not count:
        judge.share(1.0, suppressed, "")
        return
    said = (
        f"{quality.style_count} finding{'s'[: quality.style_count - 1]} in {lines} lines of code"
        if quality.style_count
        else ""
    )
    unread = [f"{file.path} {file.problem}" for file in broken[:MOST_SHOWN]]
    parts = [said, listing(quality.style), *unread, suppressed]
    seen = "\n".join(part for part in parts if part)
    judge.share(1 - 10 * count / max(1, lines), seen, "run `ament_flake8` in the package's folder; it reports the same")


def _suppressed(quality: Quality) -> str:
    if not quality.suppressions:
        return ""
    shown = some([f"{place(comment)} {comment.text[:40]}" for comment in quality.suppressions], 5)
    return f"comments that switch a linter off have no effect here: {shown}"
