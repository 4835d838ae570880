"""Nobody's hand-in disappears: every entry of an export and everyone on a list is accounted for before the grading."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import subprocess
import tarfile
import zipfile
from decimal import Decimal
from pathlib import Path

import pytest
from helpers.archives import member, write
from helpers.class_reports import graded
from submissions import hostile_class as hostile

from grader import cli
from grader.classroom import cells, discovery, gradebook, ledger, overrides, roster, times
from grader.classroom.class_folder import ClassFacts, ClassFolder, Doubt, DoubtKind
from grader.classroom.overrides import Adjustment, Decisions, PersonDecision
from grader.classroom.platform import Export
from grader.classroom.platforms.plain import PLATFORM
from grader.classroom.roster import Person
from grader.intake import containers

JANE = Person("s1", "Jane Doe", login="jdoe")
BO = Person("s2", "Bo Ek", login="boek")


def found(path: Path, people: tuple[Person, ...] = (JANE, BO), listed: str = "") -> ClassFacts:
    """Return what is found in an export, with a CSV of times beside it."""
    (path.parent / "times.csv").write_text(listed or "id,submitted\n")
    with discovery.opened(path) as source:
        return discovery.find(source, people, known_times=times.load(path.parent / "times.csv"))


def stops(what: ClassFacts) -> list[str]:
    return [doubt.what for doubt in what.doubts if doubt.stops]


def zipped(path: Path, *names: str) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, b"" if name.endswith("/") else name.encode())
    return path


def test_a_class_of_thirty_with_five_lost_hand_ins_stops_with_five_doubts(tmp_path, workers, capsys):
    """They were "nothing handed in" without a note, and 0.00 went into the line that says "Submitted for grading"."""
    hostile.lossy(tmp_path)
    made = workers(graded)
    sheet = str(tmp_path / "worksheet.csv")
    command = ["batch", str(tmp_path / "export.zip"), "--roster", sheet, "--out", str(tmp_path / "class")]
    assert cli.main([*command, "--plan"]) == 0
    plan = capsys.readouterr().out.splitlines()
    doubts = [line for line in plan if line.startswith("DOUBT, stops: ")]
    assert len(doubts) == 5, doubts
    for who in hostile.THIRTY[:5]:
        assert sum(who.name in line for line in doubts) == 1
    assert not any(line.startswith("DOUBT:") for line in plan)
    assert "5 doubts stop the class: nothing is graded before a person has looked, or says --despite-doubts." in plan
    assert "ledger: roster: 30 people = 26 with a hand-in + 4 in doubt + 0 without" in plan
    assert "ledger: list: 30 people handed in = 26 with a hand-in + 4 without" in plan
    assert any(line.startswith("ledger: moodle: 29 entries = 26 with a hand-in + 3 left out: ") for line in plan)
    assert cli.main(command) == 3
    assert made.orders == []

    assert cli.main([*command, "--despite-doubts", "--zero-missing"]) == 0
    assert len(made.orders) == 26
    rows = gradebook.read(ClassFolder(tmp_path / "class")).rows
    waiting = [row for row in rows if row.state is gradebook.State.PENDING]
    assert {row.person.name for row in waiting} == {who.name for who in hostile.THIRTY[:5] if who.n != 104}
    assert all(row.total is None for row in waiting), "not graded yet, also where missing hand-ins get 0"
    filled = tmp_path / "filled.csv"
    cli.main(["gradebook", str(tmp_path / "class"), "--for", "moodle", "--sheet", sheet, "--out", str(filled)])
    grades = {row["Full name"]: row["Grade"] for row in csv.DictReader(io.StringIO(filled.read_text("utf-8-sig")))}
    assert {grades[row.person.name] for row in waiting} == {""}


def test_what_a_list_said_is_not_forgotten_by_the_next_run(tmp_path, workers, capsys):
    hostile.lossy(tmp_path)
    workers(graded)
    sheet = str(tmp_path / "worksheet.csv")
    command = ["batch", str(tmp_path / "export.zip"), "--roster", sheet, "--out", str(tmp_path / "class")]
    cli.main([*command, "--despite-doubts"])
    capsys.readouterr()
    assert cli.main(["batch", "--out", str(tmp_path / "class")]) == 0
    assert "Given105 Family105 handed in by the list" in capsys.readouterr().err


def test_two_peoples_entries_of_one_path_stop_the_class(tmp_path):
    """One person's was gone without a word."""
    with pytest.warns(UserWarning, match="Duplicate name"):
        what = found(zipped(tmp_path / "lab.zip", "lab/Jane Doe/a.zip", "lab/Jane Doe/a.zip", "lab/Bo Ek/a.zip"))
    (said,) = stops(what)
    assert said.startswith("A part of the hand-in of Jane Doe was left out: lab/Jane Doe/a.zip: its name occurs again")


@pytest.mark.parametrize("name", ["a" * 271 + ".zip", "\u0436" * 140 + ".zip"])
def test_a_long_name_is_shortened(tmp_path, name):
    what = found(zipped(tmp_path / "lab.zip", f"Jane Doe/{name}", "Bo Ek/a.zip"))
    assert stops(what) == []
    assert what.missing == ()


def test_of_a_long_name_whose_it_is_stays(tmp_path):
    long = "b" * 300
    what = found(zipped(tmp_path / "e.zip", f"Jane Doe_4001_assignsubmission_file_{long}.zip", f"Bo Ek{long}"[:100]))
    assert [entry.people for entry in what.entries if "Jane" in entry.label] == [(JANE,)]


def test_an_empty_folder_in_an_archive_is_a_hand_in(tmp_path):
    """Nothing of it was left, so it was nobody's."""
    what = found(zipped(tmp_path / "lab.zip", "Jane Doe/", "Bo Ek/a.zip"))
    assert [entry.label for entry in what.entries] == ["Bo Ek", "Jane Doe"]


def test_a_loose_file_that_is_called_like_somebody_without_a_hand_in_stops_the_class(tmp_path):
    what = found(write(tmp_path / "e", dict.fromkeys(("jdoe.zip", "Bo Ek.py", "grades.ods", ".boek"), "x")))
    assert stops(what) == ["Bo Ek.py is neither an archive nor a folder.", ".boek is hidden."]
    assert what.ledger[0] == "plain: 4 entries = 1 with a hand-in + 3 left out: Bo Ek.py, grades.ods, .boek"


@pytest.mark.parametrize(
    ("remarks", "sure"), [((), True), (("report.pdf is neither an archive nor a folder.",), False)]
)
def test_what_a_platforms_module_says_nothing_of_may_be_a_hand_in(tmp_path, remarks, sure):
    (tmp_path / "report.pdf").touch()
    export = ledger.account(Export("new", (), remarks), PLATFORM, tmp_path, ledger.Source(tmp_path))
    assert [(each.label, each.sure) for each in export.lost] == [("report.pdf", sure)]


def test_who_handed_in_by_the_list_and_has_nothing_stops_the_class(tmp_path):
    listed = "id,submitted\ns1,2026-11-20T10:00\ns2,2026-11-20T11:00\n"
    people = (JANE, BO, Person("s3", "Ann Lee"))
    (said,) = stops(found(zipped(tmp_path / "lab.zip", "Jane Doe/a.zip", "Ann Lee/a.zip"), people, listed))
    assert said == "Bo Ek handed in by the list, and the export has nothing of theirs."


def test_a_list_of_canvas_says_who_handed_in(tmp_path):
    people = (Person("s1", "Jane Doe", lms_id="11", lms="canvas"), Person("s2", "Bo Ek", lms_id="12", lms="canvas"))
    write(tmp_path / "e", {"doejane_11_900_a.zip": "x"})
    rows = [{"user_id": 11, "submitted_at": "2026-11-20T22:58:01Z"}, {"user_id": 12, "submitted_at": None}]
    for at, expected in ((None, 0), ("2026-11-20T22:58:01Z", 1)):
        rows[1]["submitted_at"] = at
        (tmp_path / "list.json").write_text(json.dumps(rows))
        what = discovery.find(tmp_path / "e", people, known_times=times.load(tmp_path / "list.json"))
        assert len(stops(what)) == expected


def test_an_unmatched_hand_in_may_be_the_listed_ones(tmp_path):
    """A person whose hand-in is there under another name is one doubt, and not two that stop."""
    listed = "id,submitted\ns1,2026-11-20T10:00\ns2,2026-11-20T11:00\n"
    what = found(zipped(tmp_path / "lab.zip", "Jane Doe/a.zip", "x17/a.zip"), listed=listed)
    assert stops(what) == []
    assert {doubt.kind for doubt in what.doubts} == {DoubtKind.UNMATCHED, DoubtKind.LOST}


def test_a_decision_ends_the_doubt_about_a_lost_hand_in():
    decided = PersonDecision(adjustments=(Adjustment("total", Decimal(0), "never came", "Ada"),))
    doubt = Doubt(DoubtKind.LOST, "Bo Ek", "", "", people=(BO,), stops=True)
    assert overrides._undecided(doubt, Decisions(people={BO.key: decided})) is None
    assert overrides._undecided(doubt, Decisions()) == doubt


def test_a_link_inside_a_hand_in_stops_nobody(tmp_path):
    with tarfile.open(tmp_path / "e.tar", "w") as archive:
        for name in ("Jane Doe/package.xml", "Bo Ek/package.xml"):
            archive.addfile(member(name), io.BytesIO())
        archive.addfile(member("Bo Ek/again", tarfile.SYMTYPE, "package.xml"))
    assert stops(found(tmp_path / "e.tar")) == []


def test_a_file_that_cannot_be_read_is_that_persons_error(tmp_path, workers):
    """It ended the run with status 3 for all."""
    write(tmp_path / "e", {"boek.zip": "x"})
    (tmp_path / "e" / "jdoe.zip").symlink_to("/proc/self/mem")  # not even root reads its first byte
    what = found(tmp_path / "e")
    assert stops(what) == []
    assert [doubt.what for doubt in what.doubts] == ["jdoe cannot be read: Input/output error."]
    assert {entry.people for entry in what.entries} == {(JANE,), (BO,)}


def test_an_archive_of_clones_is_recognised(tmp_path):
    """`.git` was left out, so that folders without a login and a time were left."""
    for login in ("jdoe", "boek"):
        clone = tmp_path / "robots-submissions" / f"robots-{login}"
        clone.mkdir(parents=True)
        git = ["git", "-c", "user.name=x", "-c", "user.email=x@y", "-C", str(clone)]
        subprocess.run([*git, "init", "-q"], check=True)
        dated = {"PATH": os.environ["PATH"], "GIT_COMMITTER_DATE": "2026-11-20T10:00:00+01:00"}
        subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "x"], check=True, env=dated)
    shutil.make_archive(str(tmp_path / "clones"), "zip", tmp_path, "robots-submissions")
    what = found(tmp_path / "clones.zip")
    assert what.layout == "git"
    assert {entry.people for entry in what.entries} == {(JANE,), (BO,)}


@pytest.mark.parametrize("form", ["tar", "zip"])
def test_the_limits_of_a_submission_are_not_those_of_a_class(tmp_path, monkeypatch, form):
    """300 submissions as a tar were refused for their 250 MB together."""
    small = containers.SizeLimits(entries=3, tar_bytes=20_000)
    monkeypatch.setattr(containers.open_container, "__defaults__", ((), small))
    names = [f"s{number}.zip" for number in range(8)]
    if form == "zip":
        zipped(tmp_path / "e.zip", *names)
    else:
        with tarfile.open(tmp_path / "e.tar", "w") as archive:
            for name in names:
                info = member(name)
                info.size = 9_000
                archive.addfile(info, io.BytesIO(bytes(9_000)))
    assert len(found(tmp_path / f"e.{form}", ()).entries) == 8


def test_ids_that_differ_by_zeros_at_the_beginning_are_named(tmp_path):
    (doubt,) = found(write(tmp_path / "e", {"12345.zip": "x"}), (Person("0012345", "Jane Doe"),)).doubts[:1]
    assert "12345 is Jane Doe's id 0012345 but for zeros at its beginning" in doubt.what
    assert doubt.people == (Person("0012345", "Jane Doe"),)


@pytest.mark.parametrize(("name", "offered"), [("Abgabe_jdoe_final", True), ("jdoe+boek", False), ("jdoes", False)])
def test_a_name_with_one_login_of_the_roster_in_it_is_offered(tmp_path, name, offered):
    what = found(write(tmp_path / "e", {f"{name}.zip": "x"}))
    doubt = next(doubt for doubt in what.doubts if doubt.entry)
    assert (doubt.people == (JANE,)) is offered
    assert ("has the login jdoe of Jane Doe in it" in doubt.text) is offered
    assert what.entries[0].people == ()


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "utf-8"])
@pytest.mark.parametrize("first", ["sep=;\r\n", ""])
def test_what_excel_saves_is_read_and_comes_back_as_it_was(tmp_path, encoding, first):
    text = f"{first}id;name;x, y\r\n007;Zo\u00eb;\r\n"
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    assert roster.load(tmp_path / "a.csv") == (Person("007", "Zo\u00eb"),)
    sheet = cells.Sheet(tmp_path / "a.csv")
    assert sheet.rows == [["007", "Zo\u00eb", ""]]
    sheet.set(0, 2, "9.50")
    sheet.write(tmp_path / "b.csv")
    assert (tmp_path / "b.csv").read_bytes() == text.replace("Zo\u00eb;", "Zo\u00eb;9.50").encode(encoding)


def test_of_several_versions_the_last_is_v10_and_the_plan_says_so(tmp_path):
    names = [f"Jane Doe_41_assignsubmission_file/lab_v{n}.zip" for n in (1, 9, 10)]
    what = found(zipped(tmp_path / "e.zip", *names))
    assert what.entries[0].path.name == "lab_v10.zip"
    assert what.notes == ("Jane Doe: lab_v10.zip is graded, the last one, not lab_v1.zip, lab_v9.zip.",)


@pytest.mark.parametrize("separator", ["/", "_"])
def test_a_text_beside_a_package_is_accounted_for(tmp_path, separator):
    start = "Jane Doe_41_assignsubmission"
    what = found(
        zipped(tmp_path / "e.zip", f"{start}_file{separator}a.zip", f"{start}_onlinetext{separator}online.html")
    )
    assert stops(what) == []
    assert what.ledger[0] == "moodle: 2 entries = 1 with a hand-in + 1 beside one of the same people"


def test_a_state_without_a_time_says_who_handed_in(tmp_path):
    lines = (
        "Identifier,Full name,Status,Grade,Last modified (grade)",
        "Participant 41,Jane Doe,Submitted for grading - ,,-",
        "Participant 42,Bo Ek,No submission - ,,-",
    )
    (tmp_path / "sheet.csv").write_text("\n".join(lines))
    assert [[claim.value for claim in time.claims] for time in times.load(tmp_path / "sheet.csv")] == [
        ["41", "Jane Doe"]
    ]


def test_a_hand_in_that_is_a_link_to_nowhere_is_not_nothing(tmp_path):
    write(tmp_path / "plain", {"boek.zip": "x"})
    (tmp_path / "plain" / "jdoe.zip").symlink_to("gone")
    assert stops(found(tmp_path / "plain")) == ["jdoe.zip is neither an archive nor a folder."]
    (tmp_path / "moodle").mkdir()
    (tmp_path / "moodle" / "Jane Doe_41_assignsubmission_file").symlink_to("gone")
    what = found(tmp_path / "moodle", (JANE,))
    assert [doubt.what for doubt in what.doubts] == ["Jane Doe cannot be read: No such file or directory."]
    assert what.missing == ()
