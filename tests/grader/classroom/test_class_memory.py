"""A class remembers how it was graded; a later run changes it only when its command says so."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from helpers.archives import write
from helpers.class_reports import graded

from grader import cli
from grader.classroom import gradebook, overview
from grader.classroom.class_folder import ClassFolder, Status
from grader.classroom.gradebook import State
from grader.classroom.one_grading import Ending, Order
from grader.host import provenance
from grader.scoring import rubric

ROSTER = "id,name,login\ns1,Jane Doe,team01\ns2,Bo Ek,team02\ns3,Eva Ost,team03\n"


def first_run(tmp_path: Path, *options: str) -> int:
    (tmp_path / "roster.csv").write_text(ROSTER)
    return cli.main(
        [
            *("batch", str(tmp_path / "source"), "--roster", str(tmp_path / "roster.csv"), "--seed", "7"),
            *("--deadline", "2026-11-20T23:59", "--late", "10 % per started day", "--out", str(tmp_path / "class")),
            *options,
        ]
    )


@pytest.fixture
def first(tmp_path, source, workers) -> None:
    """A first run, in which all three submissions were graded."""
    workers(graded)
    assert first_run(tmp_path) == 0


def again(tmp_path: Path, *options: str) -> int:
    return cli.main(["batch", "--out", str(tmp_path / "class"), *options])


def test_a_second_run_without_options_graded_the_class_with_another_seed_and_no_deadline(tmp_path, source, workers):
    """`--seed 7` once and left out the next time: half a class was graded with each seed, and nobody was late."""
    seeds: list[int] = []

    def grade(order: Order) -> Ending:
        seeds.append(order.seed)
        return graded(order)

    workers(grade)
    assert first_run(tmp_path) == 0
    (source / "team02" / "readme").write_text("handed in again")
    facts = ClassFolder(tmp_path / "class").facts()
    assert again(tmp_path) == 0
    assert seeds == [7, 7, 7, 7]
    now = ClassFolder(tmp_path / "class").facts()
    assert (now.seed, now.deadline, now.late_rule) == (7, facts.deadline, "10 % per started day")
    assert [entry.people[0].name for entry in now.entries] == ["Jane Doe", "Bo Ek", "Eva Ost"]


@pytest.mark.parametrize("options", [["--seed", "8"], ["--rubric", "other.yaml"]])
def test_what_makes_all_grades_void_is_refused_unless_everything_is_to_be_graded_anew(
    tmp_path, first, workers, capsys, monkeypatch, options
):
    monkeypatch.chdir(tmp_path)
    Path("other.yaml").write_text(rubric.RUBRIC.read_text() + "# mine\n")
    before = (tmp_path / "class" / "class.yaml").read_bytes()
    capsys.readouterr()
    assert again(tmp_path, *options) == 2
    assert f"has another {options[0][2:]}. With this one all grades are void" in capsys.readouterr().err
    assert (tmp_path / "class" / "class.yaml").read_bytes() == before
    second = workers(graded)
    assert again(tmp_path, *options, "--fresh") == 0
    assert second.orders == ["team01", "team02", "team03"]


def test_what_changes_no_grade_counts_from_then_on_and_is_said(tmp_path, first, workers, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("other.csv").write_text(ROSTER.rsplit("s3")[0])
    second = workers(graded)
    capsys.readouterr()
    words = ["--deadline", "2026-11-22T23:59", "--late", "2 points per started day", "--roster", "other.csv"]
    assert again(tmp_path, *words) == 0
    said = capsys.readouterr().err
    for each in (
        "The deadline was 2026-11-20 23:59, and is 2026-11-22 23:59 from now on.",
        "The late rule was 10 % per started day, and is 2 points per started day from now on.",
        "The roster was 3 people, and is 2 people from now on.",
    ):
        assert each in said
    assert second.orders == []
    assert ClassFolder(tmp_path / "class").facts().late_rule == "2 points per started day"


@pytest.mark.slow  # two runs of a class
def test_the_rubric_of_the_class_counts_when_the_kit_has_another_one_by_now(tmp_path, first, workers, monkeypatch):
    (tmp_path / "updated.yaml").write_text(rubric.RUBRIC.read_text() + "# of the next version\n")
    monkeypatch.setattr(rubric, "RUBRIC", tmp_path / "updated.yaml")
    second = workers(graded)
    assert again(tmp_path) == 0
    assert second.orders == []


def test_a_partial_export_turned_graded_people_into_nothing_handed_in(tmp_path, source, first):
    """The late hand-ins were exported on Monday, and everybody else had 0."""
    (tmp_path / "late").mkdir()
    (source / "team02").rename(tmp_path / "late" / "team02")
    assert again(tmp_path, str(tmp_path / "late")) == 0
    folder = ClassFolder(tmp_path / "class")
    states = {row.person.name: (row.submission, row.state) for row in gradebook.read(folder).rows}
    assert states == {
        "Jane Doe": ("team01", State.GRADED), "Bo Ek": ("team02", State.GRADED), "Eva Ost": ("team03", State.GRADED),
    }  # fmt: skip
    assert [(entry.id, entry.absent) for entry in folder.facts().entries] == [
        ("team01", True), ("team02", False), ("team03", True),
    ]  # fmt: skip
    assert folder.facts().entries[0].source == str(source)


@pytest.mark.slow  # three runs of a class
def test_a_second_source_is_read_from_then_on_and_one_that_is_gone_costs_nobody_a_grade(
    tmp_path, source, first, workers, capsys
):
    late = tmp_path / "late.zip"
    with zipfile.ZipFile(late, "w") as archive:
        archive.writestr("team04/readme", "late")
    second = workers(graded)
    assert again(tmp_path, "--add", str(late)) == 0
    source.rename(tmp_path / "elsewhere")
    assert again(tmp_path) == 0
    assert second.orders == ["team04"]
    facts = ClassFolder(tmp_path / "class").facts()
    assert [(entry.id, entry.source) for entry in facts.entries if not entry.absent] == [("team04", str(late))]
    said = "3 kept from an earlier source, and in none of the present ones: team01, team02, team03"
    assert said in capsys.readouterr().err
    assert {row.state for row in gradebook.read(ClassFolder(tmp_path / "class")).rows} == {State.GRADED}


def test_an_absent_submission_without_a_grade_is_a_doubt_and_not_a_zero(tmp_path, source, workers, capsys):
    workers(lambda order: Ending(Status.ERROR, "killed") if order.id == "team03" else graded(order))
    first_run(tmp_path)
    (source / "team03").rename(tmp_path / "team03")
    capsys.readouterr()
    assert again(tmp_path) == 3
    assert "DOUBT: team03 has no grade" in capsys.readouterr().err
    row = next(row for row in gradebook.read(ClassFolder(tmp_path / "class")).rows if row.submission == "team03")
    assert (row.state, row.total) == (State.ERROR, None)


def test_only_the_named_submissions_are_graded(tmp_path, source, workers, capsys):
    made = workers(graded)
    assert first_run(tmp_path, "--only", "team02") == 0
    assert made.orders == ["team02"]
    assert again(tmp_path, "--only", "team09") == 2
    assert "has no submission team09. It has team01, team02, team03." in capsys.readouterr().err


@pytest.mark.slow  # three runs of a class
def test_an_update_of_the_kit_regraded_the_class_unasked(tmp_path, source, first, workers, monkeypatch, capsys):
    monkeypatch.setattr(provenance, "kit_hash", lambda _course: "0123456789abcdef")
    second = workers(graded)
    write(source, {"team04/readme": "new"})
    assert again(tmp_path) == 0
    assert second.orders == ["team04"]
    assert "3 kept from another kit: team01, team02, team03; --regrade grades them again" in capsys.readouterr().err
    folder = ClassFolder(tmp_path / "class")
    old = folder.record("team01")
    assert old is not None
    kits = {row.submission: row.kit for row in gradebook.read(folder).rows}
    assert kits["team01"] == old.kit[:8] != kits["team04"] == "01234567"
    page = overview.write(folder, gradebook.read(folder)).read_text()
    assert "graded by 2 versions of the kit" in page
    assert f"graded by kit {old.kit[:8]}" in page


def test_a_class_is_not_a_source(tmp_path, first, capsys):
    assert cli.main(["batch", str(tmp_path / "class")]) == 2
    assert f"Go on with it: grader batch --out {tmp_path / 'class'}" in capsys.readouterr().err


def test_a_first_run_without_a_source_writes_nothing(tmp_path, capsys):
    assert again(tmp_path) == 3
    assert "is not a class: it has no class.yaml" in capsys.readouterr().err
    assert not (tmp_path / "class").exists()


def test_a_doubt_that_was_accepted_does_not_stop_the_class_once_more(tmp_path, source, workers, capsys):
    workers(graded)
    (tmp_path / "roster.csv").write_text("id,login\ns9,nobody\n")
    words = ["batch", str(source), "--roster", str(tmp_path / "roster.csv"), "--out", str(tmp_path / "class")]
    assert cli.main(words) == 3
    assert "Nothing was graded" in capsys.readouterr().err
    assert not (tmp_path / "class" / "class.yaml").exists()
    assert cli.main([*words, "--despite-doubts"]) == 0
    assert again(tmp_path) == 0
    write(source, {"team04/readme": "new"})
    assert again(tmp_path) == 3, "it is another doubt by now"
