"""Names of files by a pattern: those of docs/classes.md, and whatever else a platform calls them."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import pytest
from helpers.class_reports import graded

from grader import cli
from grader.classroom import discovery
from grader.classroom.class_folder import ClassFacts
from grader.classroom.discovery import Found
from grader.classroom.platforms import Pattern
from grader.classroom.roster import Person
from grader.errors import UsageError

JANE = Person("s1", "Jane Doe", login="jane_doe")
BO = Person("s2", "Bo Ek", login="boek")


def find(root: Path, *names: str, pattern: str = "") -> Found:
    for name in names:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(name)
    return discovery.find(root, [JANE, BO], ClassFacts(pattern=pattern))


def whose(found: Found) -> dict[str, tuple[Person, ...]]:
    return {entry.path.name: entry.people for entry in found.entries}


BLACKBOARD = "Lab_3_{}_attempt_2026-11-{}-22-58-01"


def test_blackboard_writes_assignment_login_attempt_and_time(tmp_path):
    found = find(
        tmp_path,
        f"{BLACKBOARD.format('jane_doe', 19)}_robot.zip",
        f"{BLACKBOARD.format('jane_doe', 20)}_robot_v2.zip",
        f"{BLACKBOARD.format('jane_doe', 20)}.txt",
        f"{BLACKBOARD.format('boek', 20)}_a_b.zip",
        pattern="*_{login}_attempt_{time}[_{file}]",
    )
    assert whose(found) == {
        f"{BLACKBOARD.format('jane_doe', 20)}_robot_v2.zip": (JANE,),
        f"{BLACKBOARD.format('boek', 20)}_a_b.zip": (BO,),
    }
    assert {entry.submitted for entry in found.entries} == {dt.datetime(2026, 11, 20, 22, 58, 1).astimezone()}
    assert any("counts, not" in doubt.what for doubt in found.doubts)


def test_brightspace_writes_numbers_name_and_time(tmp_path):
    found = find(
        tmp_path,
        "13394-80551 - Jane Doe - Nov 20, 2026 1058 PM - Doe - Homework 6.zip",
        "13395-80551 - Bo Ek - Nov 20, 2026 905 AM/robot.zip",
        pattern="{number} - {name} - {time}[ - {file}]",
    )
    assert {entry.label: (entry.people, entry.submitted.hour, entry.number) for entry in found.entries} == {
        "Jane Doe": ((JANE,), 22, "13394"),
        "Bo Ek": ((BO,), 9, "13395"),
    }


def test_ilias_writes_a_folder_for_each_and_one_around_those_of_a_team(tmp_path):
    names = ("Doe_Jane_jane_doe_4711/robot.zip", "Team 12/Ek_Bo_boek_4712/robot.zip")
    found = find(tmp_path / "Abgaben", *names, pattern="*_{login}_{number}")
    assert {entry.people for entry in found.entries} == {(JANE,), (BO,)}
    assert all(entry.path.name == "robot.zip" for entry in found.entries)


def test_a_pattern_of_ones_own_with_attempts_takes_the_last_by_number(tmp_path):
    names = ("boek-2026_1.zip", "boek-2026_9.zip", "boek-2026_10.zip", "jane_doe-2026_1.zip")
    found = find(tmp_path, *names, pattern="{login}-*_{attempt}")
    assert whose(found) == {"boek-2026_10.zip": (BO,), "jane_doe-2026_1.zip": (JANE,)}
    (note,) = found.notes
    assert note == "boek: attempt 10 is graded, the last one, not boek-2026_1.zip, boek-2026_9.zip."


@pytest.mark.parametrize(
    "text", ["20261120_2258", "20261120225800", "2026-11-20T22.58", "2026-11-20 22:58", "20 November 2026 22:58"]
)
def test_a_time_in_a_name_is_read(text):
    found = Pattern("{login}__{time}").read(Path(f"boek__{text}.zip"))
    assert found is not None
    assert found.when == dt.datetime(2026, 11, 20, 22, 58).astimezone()


@pytest.mark.parametrize("text", ["{time}", "", "{logn}", "{login}[", "{login}{login}", "moodle"])
def test_what_is_no_pattern_is_refused_with_what_is(text):
    with pytest.raises(UsageError, match=r"Write the name with \{login\}"):
        Pattern(text)


def test_a_class_remembers_its_pattern(tmp_path, workers, capsys):
    workers(graded)
    (tmp_path / "e").mkdir()
    (tmp_path / "e" / "x-boek.zip").write_text("x")
    (tmp_path / "roster.csv").write_text("id,login\ns2,boek\n")
    out = ["--out", str(tmp_path / "class")]
    wanted = ["batch", str(tmp_path / "e"), "--roster", str(tmp_path / "roster.csv"), "--pattern", "x-{login}", *out]
    assert cli.main(wanted) == 0
    assert cli.main(["batch", *out]) == 0
    assert "1 kept" in capsys.readouterr().err
