"""A class of hostile normality through each platform and back: nobody has another's grade; every doubt is listed."""

from __future__ import annotations

import csv
import io
import json
import re
import unicodedata
import zipfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from helpers.class_reports import Workers, report
from submissions import hostile_class as hostile
from submissions.hostile_class import ABSENT, ANONYMOUS, CLASS, LATE, ROSTER, UNKNOWN, Student

from grader import cli
from grader.classroom import batch
from grader.classroom.class_folder import Status
from grader.classroom.one_grading import Ending, Order
from grader.scoring import rubric

LAYOUTS: dict[str, Callable[[Path], None]] = {
    "moodle": hostile.moodle,
    "moodle 3": partial(hostile.moodle, separator="_/"),
    "moodle flat": partial(hostile.moodle, separator="_"),
    "moodle groups": hostile.moodle_groups,
    "moodle 3 groups": partial(hostile.moodle, separator="_/", groups=True),
    "canvas": hostile.canvas,
    "gradescope": hostile.gradescope,
    "github": hostile.github,
}
ROSTERS = ("none", "own", "sheet")
CASES = [(layout, roster) for layout in LAYOUTS for roster in ROSTERS if (layout, roster) != ("gradescope", "sheet")]
OVERRIDES = """\
people:
  p39@uni.example: {extension: {until: 2026-11-29T00:00+00:00, why: ill, by: Ada}}
  p40@uni.example: {excused: {why: passed last year, by: Ada}}
"""


def lost_points(n: int, old: bool) -> dict[str, float]:
    """Return what a submission loses, by requirement: half a point for each number, thirty more for an old one."""
    left, lost = n / 2 + (30 if old else 0), {}
    for requirement in rubric.load(rubric.RUBRIC).requirements:
        lost[requirement.id] = min(left, requirement.points)
        left -= lost[requirement.id]
    return {name: points for name, points in lost.items() if points}


def reached(who: Student) -> Decimal:
    return Decimal(100) - Decimal(who.n) / 2


def content(path: Path) -> str:
    """Return all text of a submission."""
    if path.is_dir():
        return "".join(content(each) for each in sorted(path.rglob("*")) if each.is_file() and ".git" not in each.parts)
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            return "".join(archive.read(name).decode() for name in archive.namelist())
    return path.read_bytes().decode(errors="replace")


def grade(order: Order) -> Ending:
    """Grade by the token in a submission."""
    found = re.findall(r"token-(\d+)(-old)?\.", content(Path(order.source)))
    if len(found) != 1:
        return Ending(Status.REFUSED, "holds no package")
    made = report(lost_points(int(found[0][0]), bool(found[0][1])), submission=Path(order.source).name)
    (Path(order.out) / "report.json").write_text(json.dumps(made))
    return Ending(Status.GRADED, seconds=1.0)


@dataclass
class Outcome:
    """What became of the class: by student the values that are on rows of theirs, and what was printed when."""

    values: dict[int, set[str]] = field(default_factory=dict)
    states: dict[int, set[str]] = field(default_factory=dict)
    before: str = ""
    said: str = ""
    faults: list[str] = field(default_factory=list)
    totals: set[str] = field(default_factory=set)

    def saw(self, who: Student, value: str, state: str = "") -> None:
        self.values.setdefault(who.n, set()).add(value)
        self.states.setdefault(who.n, set()).add(state)


def run(layout: str, roster: str, tmp_path: Path, grading: Workers, monkeypatch: Any, capsys: Any) -> Outcome:
    """Take the class through `grader batch` and `grader gradebook`, as the documentation has them."""
    export, sheet, own = tmp_path / "robots-submissions", tmp_path / "sheet.csv", tmp_path / "roster.csv"
    LAYOUTS[layout](export)
    if layout.startswith("moodle"):
        hostile.worksheet(sheet, "de" if layout == "moodle 3" else "en", groups="groups" in layout)
    elif layout == "canvas":
        hostile.canvas_gradebook(sheet, ";" if roster == "own" else ",")
    elif layout == "github":
        hostile.github_roster(sheet)
    hostile.roster(own, groups="groups" in layout)
    monkeypatch.setattr(batch.sandbox, "require", lambda: None)
    outcome, klass = Outcome(), tmp_path / "class"
    people = {"none": [], "own": ["--roster", str(own)], "sheet": ["--roster", str(sheet)]}[roster]
    late = ["--deadline", hostile.DEADLINE.isoformat(), "--late", hostile.LATE_RULE]
    command = ["batch", str(export), *people, *late, "--out", str(klass)]
    status = cli.main([*command, "--plan"])  # grades nothing, so whatever it prints is printed before
    if status not in (0, 3) or grading.orders:
        outcome.faults.append(f"`grader batch --plan` ended with {status}, {len(grading.orders)} were graded")
    outcome.before = "".join(capsys.readouterr())
    status = cli.main(command)
    if status == 3 and not grading.orders:
        status = cli.main([*command, "--despite-doubts"])
    outcome.said = "".join(capsys.readouterr())
    if status:
        outcome.faults.append(f"`grader batch` ended with {status}: {(outcome.before + outcome.said)[-400:]}")
        return outcome
    if roster == "own" or layout == "gradescope":
        (klass / "overrides.yaml").write_text(OVERRIDES)
    if status := cli.main(["gradebook", str(klass)]):
        outcome.faults.append(f"`grader gradebook` ended with {status}: {''.join(capsys.readouterr())[-400:]}")
        return outcome
    read_gradebook(klass / "gradebook.csv", roster, outcome)
    if layout.startswith("moodle") or layout == "canvas":
        platform, filled = layout.split()[0], tmp_path / "filled.csv"
        wanted = ["gradebook", str(klass), "--for", platform, "--sheet", str(sheet), "--out", str(filled)]
        if status := cli.main([*wanted, *(["--assignment", "Robots"] if platform == "canvas" else [])]):
            outcome.faults.append(f"`gradebook --for {platform}` ended with {status}: {capsys.readouterr()}")
        else:
            read_sheet(sheet, filled, platform, outcome)
    return outcome


def read_gradebook(path: Path, roster: str, outcome: Outcome) -> None:
    """Note each row of gradebook.csv for whoever its id, e-mail, login or name says."""
    seen: Counter[int] = Counter()
    for row in csv.DictReader(io.StringIO(path.read_text())):
        cell = {key: value.removeprefix("'") for key, value in row.items()}
        if any(value[:1] in ("=", "+", "@") for value in row.values()):
            outcome.faults.append(f"a spreadsheet takes a cell for a formula: {row}")
        if "Test" in cell["name"]:
            outcome.faults.append(f"Canvas's Test Student is in gradebook.csv: {cell['name']}, {cell['state']}")
        links = [(cell[kind], kind) for kind in ("id", "email", "login") if cell[kind]]
        if not links and roster == "none":
            links = [(cell["submission"], "login")]
        whose = {who.n for who in CLASS for value, kind in links if value.casefold() == getattr(who, kind).casefold()}
        if len(whose) > 1:
            outcome.faults.append(f"a row of gradebook.csv is of several people: {links}")
        elif whose:
            who = next(who for who in CLASS if who.n in whose)
            names = by_name(who) | {who.name.removeprefix("Dr. "), who.name.replace(",", ""), "", who.login}
            if cell["name"] not in names:
                outcome.faults.append(f"{who.name} is called {cell['name']} in gradebook.csv")
        if (
            not whose and roster == "none"
        ):  # a name: of namesakes it may be the row of any, so that of the one who has such points
            named = [who for who in CLASS if who.name and cell["name"] in by_name(who)]
            whose = {who.n for who in named if len(named) == 1 or f"{reached(who):.2f}" == cell["total"]}
        for n in whose:
            seen[n] += 1
            outcome.saw(next(who for who in CLASS if who.n == n), cell["total"], cell["state"])
        outcome.totals.add(cell["total"])
    outcome.faults += [f"{n} has {count} rows in gradebook.csv" for n, count in seen.items() if count > 1]


def by_name(who: Student) -> set[str]:
    """Return the names under which somebody may be in a table; a name of two people is nobody's."""
    names = (who.name, hostile.moodle_name(who))
    return {unicodedata.normalize(form, name) for form in ("NFC", "NFD") for name in names}


def read_sheet(before: Path, after: Path, platform: str, outcome: Outcome) -> None:
    """Note the grades in a platform's sheet; whatever is not a grade or a comment of ours has to be as it was."""
    old, new = before.read_bytes(), after.read_bytes()
    separator = ";" if old.split(b"\n")[0].count(b";") else ","
    table = [
        list(csv.reader(io.StringIO(raw.decode("utf-8-sig"), newline=""), delimiter=separator)) for raw in (old, new)
    ]
    number, grade = (
        (1, 6)
        if platform == "canvas"
        else (0, next(place for place, name in enumerate(table[0][0]) if name in ("Grade", "Bewertung")))
    )
    ours = {grade} if platform == "canvas" else {grade, len(table[0][0]) - 1}
    lines = [raw.split(b"\r\n" if b"\r\n" in raw else b"\n") for raw in (old, new)]
    if len(lines[0]) != len(lines[1]) or old[:3] != new[:3] or (b"\r\n" in old) != (b"\r\n" in new):
        outcome.faults.append("the sheet comes back with another byte order mark, line end or number of lines")
    for place, (was, now) in enumerate(zip(*table, strict=True)):
        if [cell for at, cell in enumerate(was) if at not in ours] != [
            cell for at, cell in enumerate(now) if at not in ours
        ]:
            outcome.faults.append(f"cells of the platform's own changed: {was} -> {now}")
        if was == now and len(lines[0]) == len(lines[1]) and lines[0][place] != lines[1][place]:
            outcome.faults.append(f"a row without a grade changed: {lines[0][place]!r} -> {lines[1][place]!r}")
        who = next((who for who in ROSTER if re.sub(r"\D", "", was[number]) in (who.canvas, who.moodle)), None)
        if who is not None:
            excused = now[grade] == "EX" and who.n == 40
            outcome.saw(who, "" if excused else now[grade].replace(",", "."), "sheet")
            if was[-1] and platform == "moodle" and was[-1] not in now[-1]:
                outcome.faults.append(f"what a person wrote is gone: {was[-1]!r} -> {now[-1]!r}")
        elif now[grade] != was[grade]:
            outcome.faults.append(f"a row of nobody's got a grade: {now}")


def knows_teams(layout: str, roster: str) -> bool:
    in_the_sheet = layout in ("moodle groups", "moodle 3 groups") and roster == "sheet"
    return roster == "own" or layout == "gradescope" or in_the_sheet


def expected(who: Student, layout: str, roster: str) -> str | None:
    """Return the total that has to be on the row of `who`; None if it has to be empty."""
    handed = who
    if who.team and knows_teams(layout, roster):
        handed = next(each for each in CLASS if each.team == who.team and each.how != ABSENT)
    if handed.how in (ABSENT, "link", "text", ANONYMOUS):
        return None
    excepted = roster == "own" or layout == "gradescope"
    if who.n == 40 and excepted:
        return None
    times = layout in ("gradescope", "github") or (layout.startswith("moodle") and roster == "sheet")
    late = handed.late == LATE and times and not (who.n == 39 and excepted)
    return f"{reached(handed) * (Decimal('0.8') if late else 1):.2f}"


def judge(who: Student, outcome: Outcome, layout: str, roster: str) -> str:
    """Return right, listed, wrong or lost, with the reason."""
    right, values = expected(who, layout, roster), outcome.values.get(who.n, set())
    states = outcome.states.get(who.n, set())
    others = {value for value in values if value and Decimal(value) and value != right}
    if others:
        owner = next((f"that of {each.n} {each.name}" for each in CLASS if f"{reached(each):.2f}" in others), "another")
        return f"wrong: has {', '.join(sorted(others))} ({owner}) instead of {right}"
    if who.how == ABSENT and right is None:
        return "right"
    unknown = who.how == ANONYMOUS or (who.how == UNKNOWN and roster != "none")
    if unknown and roster == "none" and f"{reached(who):.2f}" in outcome.totals:
        return "right"
    if right is not None and values == {right}:
        return "right"
    named_after_groups = roster == "none" and "groups" in layout
    if who.how in ("text", "link") and named_after_groups:
        return "refused"  # the row has the name of the group
    if "nothing handed in" in states or any(value and not Decimal(value) for value in values):
        return f"lost: handed in, and has {sorted(values)} ({', '.join(sorted(states))})"
    if roster == "none" and right in outcome.totals:  # on a row that has the name of the account or the group
        if layout != "moodle groups":
            return "right"
        if "have names of groups" in outcome.before:
            return "listed"
    if listed(who, outcome.before) and (not unknown or f"{reached(who):.2f}" in outcome.totals):
        return "listed"
    return f"lost: {sorted(values)} ({', '.join(sorted(states))}) and not a word before the grading"


def listed(who: Student, text: str) -> bool:
    """Return whether a doubt that was printed names a hand-in."""
    doubts = "\n".join(line for line in text.splitlines() if line.startswith("DOUBT"))
    team = who.team.lower().replace(" ", "-").replace("ω", "omega")
    words = [who.canvas, who.moodle, f"submission_{5000 + who.n}", hostile.canvas_name(who), hostile.moodle_name(who)]
    words += [who.name, who.team, team, team.replace("-", ""), who.team.lower().replace(" ", "")]
    words += [f"'{who.login}'", f" {who.login} ", who.id, f"Single {who.n}"]
    if who.how == ANONYMOUS:
        words = [f"x{who.n}Kq", who.moodle, f"submission_{4000 + who.n}", "ghost-x", "Participant", "Single 48"]
    doubts = unicodedata.normalize("NFC", doubts)
    return any(unicodedata.normalize("NFC", word) in doubts for word in words if word.strip())


# `make test` runs the two with a sheet of the platform's own.
OFTEN = {("moodle", "sheet"), ("canvas", "sheet")}
SELDOM = pytest.mark.slow  # 21 classes of 50


@pytest.mark.parametrize(
    ("layout", "roster"),
    [pytest.param(*case, id=" + ".join(case), marks=() if case in OFTEN else SELDOM) for case in CASES],
)
def test_nobody_has_anothers_grade_and_nobody_is_lost(layout, roster, tmp_path, workers, monkeypatch, capsys):
    outcome = run(layout, roster, tmp_path, workers(grade), monkeypatch, capsys)
    verdicts = {who: judge(who, outcome, layout, roster) for who in CLASS}
    bad = [
        f"{who.n} {who.name or '(anonymous)'}: {v}" for who, v in verdicts.items() if v.startswith(("wrong", "lost"))
    ]
    assert not [*outcome.faults, *bad], "\n" + "\n".join([*outcome.faults, *bad])
    if (layout, roster) == ("moodle", "sheet"):  # online text in a folder had 0.00 in the platform
        assert outcome.values[36] == {""}
