"""Q1: ament_flake8's rules."""

from grader.checks.findings import listing, place
from grader.checks.judge import Judge
from grader.checks.package_text import readable_first, weighed, weights
from grader.evidence import Quality, SourceFile, reading_limits
from grader.words import MOST_SHOWN, say, say_count, some

NEEDS = ("quality", "linters")


def test_ament_flake8_finds_nothing(judge: Judge) -> None:
    """ament_flake8 finds nothing: full marks for no finding, none for 1 per 10 lines of code or more."""
    quality = weighed(judge)
    broken = [file for file in quality.files if file.problem]
    count = quality.style_count + sum(map(_findings_hidden_in, broken))
    lines = reading_limits.counted_lines(quality.files)
    suppressed = _suppressed(quality)
    if not count:
        judge.share(1.0, suppressed, "")
        return
    said = (
        say_count(
            "{n} finding in {lines} lines of code",
            "{n} findings in {lines} lines of code",
            quality.style_count,
            lines=lines,
        )
        if quality.style_count
        else ""
    )
    unread = [f"{file.path} {file.problem}" for file in broken[:MOST_SHOWN]]
    density = count / max(1, lines)
    of_nodes, where = _of_the_nodes(judge)
    parts = [said, where if of_nodes > density else "", listing(quality.style), *unread, suppressed]
    seen = "\n".join(part for part in parts if part)
    try_ = say("run `ament_flake8` in the package's folder; it reports the same")
    judge.share(1 - 10 * max(density, of_nodes), seen, readable_first(broken, try_))


def _findings_hidden_in(file: SourceFile) -> float:
    """Return for how many findings a file counts that the linter cannot read.

    One that is broken is no better than code with a finding on every tenth line. Where Python runs what the linter is
    kept from reading, it may be the worst code: one on every line, so that nobody gains by making a bad module larger.
    """
    return max(1.0, file.lines if reading_limits.runs_unread(file) else file.lines / 10)


def _of_the_nodes(judge: Judge) -> tuple[float, str]:
    """Return the findings per line in the code that the nodes reach, and say how many they are.

    Other code, however clean, does not dilute the findings in the nodes.
    """
    reached = judge.quality().reached
    if reached is None:
        return 0.0, ""
    weight = weights(judge, reached.lines)
    count, lines = sum(reached.style.values()), sum(reached.lines.values())
    average = sum(weight.get(path, 0.0) * found for path, found in reached.style.items())
    average /= max(1.0, sum(weight[path] * reached.lines[path] for path in weight))
    return max(average, count / max(1, lines)), say(
        "in the code that the nodes use, {count} in {lines}", count=count, lines=lines
    )


def _suppressed(quality: Quality) -> str:
    if not quality.suppressions:
        return ""
    shown = some([f"{place(comment)} {comment.text[:40]}" for comment in quality.suppressions], 5)
    return say("comments that switch a linter off have no effect here: {shown}", shown=shown)
