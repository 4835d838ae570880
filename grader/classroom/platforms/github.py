"""GitHub: annotations and step summary of a workflow, and the result that GitHub Classroom's reporter reads.

Formats: GitHub's "Workflow commands", and classroom-resources/autograding-grading-reporter.
"""

from __future__ import annotations

import base64
import datetime as dt
import json
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from grader import sandbox
from grader.classroom.gradebook import Row
from grader.classroom.identity import Claim
from grader.classroom.platform import Delivery, Export, HandIn, Platform, comment, has, judged, others
from grader.host import submission_user, tempdir
from grader.host.tempdir import write_atomically
from grader.sanitize import printable, prose
from grader.scoring.rubric import Rubric

MOST_ANNOTATIONS = 10  # of one kind are shown for a step; the rest is in the summary
MOST_SUMMARY_BYTES = 1024 * 1024
_TEXT = 300
_INSIDE = "/repository"
_ENVIRONMENT = {"PATH": "/usr/bin:/bin", "HOME": "/tmp", "GIT_CONFIG_NOSYSTEM": "1"}
_GIT = ("git", "--no-pager", "-c", "safe.directory=*", f"--git-dir={_INSIDE}")


def _write(delivery: Delivery) -> list[str]:
    """Write annotations.txt, summary.md and classroom.txt for each submission, in ID/ below `delivery.out`.

    A workflow prints the first, appends the second to $GITHUB_STEP_SUMMARY and the third to $GITHUB_OUTPUT.
    """
    for row in delivery.book.teams.values():
        report, rubric = delivery.reports.get(row.submission, {}), delivery.book.rubric
        texts = {
            "annotations.txt": workflow_commands(row, rubric, report),
            "summary.md": summary(row, rubric, report),
            "classroom.txt": f"result={classroom(row, rubric, report)}\n",
        }
        for name, text in texts.items():
            write_atomically(delivery.out / row.submission / name, text)
    return delivery.book.apart()


def workflow_commands(row: Row, rubric: Rubric, report: dict[str, Any]) -> str:
    """Return workflow commands: one for each requirement that lost points, the dearest first."""
    lost = [(each, said) for each, _, said in judged(row, rubric, report) if each.lost > 0]
    lines = []
    for each, said in sorted(lost, key=lambda one: -one[0].lost)[:MOST_ANNOTATIONS]:
        text = _joined(said) or prose(row.comment) or "no points"
        title = f"{each.id}: {each.points} of {each.max} points"
        lines.append(f"::warning title={_data(title, ':,')}::{_data(printable(text, 900))}\n")
    total = "no grade" if row.total is None else f"{row.total} of {row.max}"
    shown = printable(comment(row, rubric, total), 900) if row.flags else total
    return f"::notice title=Points::{_data(shown)}\n" + "".join(lines)


def summary(row: Row, rubric: Rubric, report: dict[str, Any]) -> str:
    """Return the summary of a step: a table of all requirements, and what was lost, as GitHub's Markdown."""
    found = judged(row, rubric, report)
    total = "no grade" if row.total is None else f"{row.total} of {row.max} points"
    lines = [f"# {_markdown(rubric.title)}: {total}", ""]
    if remarks := comment(row, rubric):
        lines += [_markdown(prose(remarks)), ""]
    lines += ["| requirement | points | of | |", "|---|---:|---:|---|"]
    for each, title, _ in found:
        shown = "withheld" if each.withheld else "not graded" if each.points is None else str(each.points)
        mark = "" if each.points == each.max else "by a person" if each.override else _markdown(each.outcome)
        mark = "until a person decides" if each.withheld else mark
        lines.append(f"| {_markdown(title)} | {shown} | {each.max} | {mark} |")
    for _, title, said in found:
        if said:
            lines += ["", f"## {_markdown(title)}", ""]
            lines += [f"    {printable(line, 1000)}" for line in said]  # as code, which Markdown leaves alone
    text = "\n".join(lines) + "\n"
    return text.encode()[: MOST_SUMMARY_BYTES - 1].decode(errors="ignore")


def classroom(row: Row, rubric: Rubric, report: dict[str, Any]) -> str:
    """Return the result of a step of GitHub Classroom: base64 of JSON, version 3. Its numbers are whole or not."""
    tests = [
        {
            "name": title,
            "status": "pass" if each.points == each.max else "fail",
            "message": printable(_joined(lost), _TEXT),
            "test_code": "",
            "task_id": 0,
            "filename": "",
            "line_no": 0,
            "duration": 0,
            "score": float(each.points or 0),
        }
        for each, title, lost in judged(row, rubric, report)
        if each.points is not None
    ]
    state = "error" if row.total is None else "pass" if row.total == row.max else "fail"
    said = comment(row, rubric)
    data = {"version": 3, "status": state, "message": said, "max_score": float(row.max), "tests": tests}
    return base64.b64encode(json.dumps(data).encode()).decode()


def _joined(said: Sequence[str]) -> str:
    return " | ".join(map(str.strip, said))


def _data(text: str, more: str = "") -> str:
    """Return text that a workflow command takes as it is, as a property with `more` signs escaped."""
    return "".join(f"%{ord(char):02X}" if char in f"%\r\n{more}" else char for char in text)


def _markdown(text: str) -> str:
    """Return text in which Markdown and HTML mean nothing."""
    shown = "".join(f"\\{char}" if char in "\\`*_{}[]<>#+!|~@" else char for char in printable(text, 1000))
    return shown.replace("\\<", "&lt;").replace("\\>", "&gt;")


def _read(root: Path, entries: Sequence[Path]) -> Export:
    """`assignment-login/`, clones of GitHub Classroom's repositories. All the names begin with the assignment's."""
    clones = [entry for entry in entries if has(entry, ".git")]
    names = [clone.name for clone in clones]
    prefix = f"{root.name.removesuffix('-submissions')}-" if root.name.endswith("-submissions") else ""
    guessed = not prefix or not all(name.startswith(prefix) for name in names)
    if guessed:
        common = os.path.commonprefix(names) if len(names) > 1 else names[0]  # noqa: RUF071  # characters are meant
        prefix = common[: common.rfind("-") + 1]
    hand_ins = [
        HandIn(clone, clone.name.removeprefix(prefix), _claims(clone.name, prefix, guessed), _last_commit(clone))
        for clone in clones
    ]
    more, notes = others(entry for entry in entries if entry not in clones)
    return Export("git", (*hand_ins, *more), tuple(notes))


def _last_commit(repository: Path) -> dt.datetime | None:
    """Return when the last commit was made, as its author's machine said, or None if there is none.

    git runs in the sandbox: a repository's settings can start programs.
    """
    with tempdir.folder("repository") as scratch, submission_user.readable_by_sandboxes():
        # A copy, because a clone may be readable by its owner alone, and the sandbox's user is another one.
        copy = scratch / "git"
        try:
            if not (repository / ".git").is_dir():
                return None
            shutil.copytree(repository / ".git", copy, symlinks=True, copy_function=shutil.copyfile)
        except OSError:  # the grading of this one says what cannot be read
            return None
        scratch.chmod(0o755)
        box = sandbox.Sandbox(read_only={copy: _INSIDE}, environment=_ENVIRONMENT)
        command = [*_GIT, "log", "-1", "--format=%cI", "--no-show-signature"]
        ended = sandbox.run(command, box, sandbox.Limits(wall_seconds=20.0))
    try:
        return dt.datetime.fromisoformat(ended.output.strip()) if ended.ok else None
    except ValueError:
        return None


def _claims(name: str, prefix: str, guessed: bool) -> tuple[tuple[Claim, ...], ...]:
    """Return the login or the team; all logins may begin alike, so that a guessed prefix is too long."""
    starts = [len(prefix)]
    if guessed:
        starts += [place + 1 for place, char in enumerate(prefix[:-1]) if char == "-"] + [0]
    return (tuple(Claim(kind, name[start:]) for start in starts for kind in ("login", "team")),)


PLATFORM = Platform(
    "github", "git", "github", lambda _root, entries: any(has(entry, ".git") for entry in entries), _read, _write
)
