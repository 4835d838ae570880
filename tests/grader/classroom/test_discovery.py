"""From an export and a roster to entries: who handed in what, under which id."""

from __future__ import annotations

import datetime as dt
import re
import subprocess
import tempfile
from pathlib import Path

import pytest
from helpers.archives import write
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.classroom import discovery
from grader.classroom.class_folder import ClassFacts, DoubtKind, Entry
from grader.classroom.roster import Person

JANE = Person("s1", "Jane Doe", "jane@uni.edu", "jdoe", "team07", "12345")
LI = Person("s2", "Li Wu", "li@uni.edu", "liwu", "team07", "12346")
BO = Person("s3", "Bo Ek", "bo@uni.edu", "boek", "", "12347")


def test_a_team_submission_is_all_its_members(tmp_path):
    (tmp_path / "Team07.zip").touch()
    found = discovery.find(tmp_path, [JANE, LI, BO])
    (entry,) = found.entries
    assert (entry.id, entry.people) == ("team07", (JANE, LI))
    assert found.missing == (BO,)


@pytest.mark.parametrize(
    "name",
    ["boek.zip", "s3.zip", "bo@uni.edu.zip", "Bo Ek.zip", "ek,_bo.zip", "ekbo_12347_9_pkg.zip"],
)
def test_a_person_is_found_by_whatever_the_export_calls_them(tmp_path, name):
    (tmp_path / name).touch()
    (entry,) = discovery.find(tmp_path, [JANE, LI, BO]).entries
    assert (entry.id, entry.people) == ("boek", (BO,))


def test_who_fits_nobody_is_graded_all_the_same_and_said(tmp_path):
    (tmp_path / "stranger.zip").touch()
    found = discovery.find(tmp_path, [JANE])
    assert [entry.id for entry in found.entries] == ["stranger"]
    assert [(doubt.kind, doubt.entry) for doubt in found.doubts if not doubt.stops] == [
        (DoubtKind.UNMATCHED, "stranger")
    ]


@pytest.mark.parametrize(
    "names",
    [
        ["doejane_1_8_a.zip", "ekbo_2_9_a.zip", "\u674e\u5c0f\u9f8d_3_9_a.zip"],
        ["Jane Doe_1_assignsubmission_file_a.zip", "Jane Doe_2_assignsubmission_file_a.zip"],
    ],
    ids=["Canvas", "Moodle, two of one name"],
)
def test_without_a_roster_the_platforms_number_says_who_is_who(tmp_path, names):
    for number, name in enumerate(names):
        (tmp_path / name).write_text(str(number))
    entries = discovery.find(tmp_path).entries
    assert len({entry.id for entry in entries}) == len(names)
    assert len({person.key for entry in entries for person in entry.people}) == len(names)
    assert all(person.label for entry in entries for person in entry.people)


LABELS = st.lists(
    st.sampled_from(
        ["Team", "team", "TEAM", "team-2", "team 2", "Team-2", "te am", "t\u00e9am", "\u738b", "\u674e", "_", "team-"]
    ),
    unique=True,
    min_size=1,
)


@settings(max_examples=40)
@given(labels=LABELS, later=LABELS)
def test_no_two_submissions_share_an_id_and_none_loses_its_own(labels, later):
    """`Team`, `team` and `team-2` had two ids; with one more folder in the next run, grades changed their owner."""

    def entries(wanted: list[str], earlier: tuple[Entry, ...]) -> dict[str, Entry]:
        with tempfile.TemporaryDirectory() as folder:
            for label in wanted:
                (Path(folder) / f"{label}.zip").write_text(label)
            return {
                entry.label: entry for entry in discovery.find(Path(folder), (), ClassFacts(entries=earlier)).entries
            }

    before = entries(labels, ())
    after = entries(sorted({*labels, *later}), tuple(before.values()))
    assert len({entry.id.casefold() for entry in after.values()}) == len(after)
    assert {label: after[label].id for label in before} == {label: entry.id for label, entry in before.items()}


def test_a_program_that_may_now_be_started_is_other_content(tmp_path):
    """`chmod +x` was the whole cure for a package, and it kept its old grade."""
    (tmp_path / "demo.py").write_text("print()\n")
    before = discovery.content_hash(tmp_path)
    (tmp_path / "demo.py").chmod(0o755)
    assert discovery.content_hash(tmp_path) != before


def test_the_latest_of_a_team_counts_where_times_tell(tmp_path):
    (tmp_path / "submission_metadata.yml").write_text(
        "submission_1:\n  :submitters:\n  - :email: jane@uni.edu\n  :created_at: 2026-11-20 10:00:00 Z\n"
        "submission_2:\n  :submitters:\n  - :email: li@uni.edu\n  :created_at: 2026-11-20 12:00:00 Z\n"
    )
    write(tmp_path, {f"submission_{number}/package.xml": str(number) for number in (1, 2)})
    found = discovery.find(tmp_path, [JANE, LI])
    (entry,) = found.entries
    assert (entry.id, entry.path.name) == ("team07", "submission_2")
    (doubt,) = found.doubts
    assert (doubt.kind, doubt.entry) == (DoubtKind.SEVERAL, "team07")
    assert re.match(r"li@uni.edu counts, not jane@uni.edu: it is the latest, of 2026-11-20", doubt.what)


@pytest.mark.parametrize(("one", "other", "ids"), [("1", "2", ["team07-jdoe", "team07-liwu"]), ("1", "1", ["team07"])])
def test_without_times_all_of_a_team_are_graded_and_the_same_bytes_once(tmp_path, one, other, ids):
    (tmp_path / "jdoe.zip").write_text(one)
    (tmp_path / "liwu.zip").write_text(other)
    assert [entry.id for entry in discovery.find(tmp_path, [JANE, LI]).entries] == ids


def test_the_time_of_a_repository_is_its_last_commits(tmp_path):
    for login in ("boek", "jdoe"):
        clone = tmp_path / f"robots-{login}"
        clone.mkdir()
        git = ["git", "-c", "user.name=x", "-c", "user.email=x@y", "-C", str(clone)]
        subprocess.run([*git, "init", "-q"], check=True)
        subprocess.run(
            [*git, "commit", "-q", "--allow-empty", "-m", "x"],
            check=True,
            env={"PATH": "/usr/bin:/bin", "GIT_COMMITTER_DATE": "2026-11-20T10:00:00+01:00"},
        )
        # A repository's own settings must not start a program on this machine.
        subprocess.run([*git, "config", "log.showSignature", "true"], check=True)
        subprocess.run([*git, "config", "gpg.program", f"touch {tmp_path}/started"], check=True)
        clone.chmod(0o700)  # a private clone is read too
    entries = discovery.find(tmp_path, [JANE, LI, BO]).entries
    assert [entry.id for entry in entries] == ["boek", "team07"]
    assert entries[0].submitted == dt.datetime(2026, 11, 20, 9, tzinfo=dt.UTC)
    assert not (tmp_path / "started").exists()


def test_the_content_of_a_folder_does_not_depend_on_its_git_history(tmp_path):
    (tmp_path / "a").write_text("1")
    before = discovery.content_hash(tmp_path)
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git" / "HEAD").write_text("ref")
    assert discovery.content_hash(tmp_path) == before
    (tmp_path / "a").write_text("2")
    assert discovery.content_hash(tmp_path) != before


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Müller, Jörg", "muller-jorg"),
        ("../../etc", "etc"),
        ("日本", "日本"),
        ("李-小龙", "李-小龙"),
        ("Петров, Йосиф", "петров-йосиф"),
        ("!", "submission"),
        ("Team 7!", "team-7"),
    ],
)
def test_an_id_is_safe_as_a_folders_name(text, name):
    assert discovery.slug(text) == name


def test_an_export_in_which_most_match_nobody_stops_the_class(tmp_path):
    for name in ("team01.zip", "team02.zip", "boek.zip"):
        (tmp_path / name).write_text(name)
    found = discovery.find(tmp_path, [JANE, BO])
    (stops,) = (doubt.what for doubt in found.doubts if doubt.stops)
    assert re.search(r"2 of 3 submissions fit nobody of the roster .*: team01, team02\.", stops)
    assert discovery.find(tmp_path).doubts == (), "without a roster there is nothing to be matched with"


def test_a_deadline_without_any_time_is_said_aloud(tmp_path):
    (tmp_path / "ekbo_12347_9_pkg.zip").touch()
    (doubt,) = discovery.find(tmp_path, [BO], ClassFacts(late_rule="1 point per day")).doubts
    assert doubt.kind is DoubtKind.NO_TIME
    assert "1 of 1 submissions have no time, so nothing is deducted for lateness: ekbo." in doubt.what
