"""Whose a submission is: no person ever gets another one's, and what is not certain is a doubt that is listed."""

from __future__ import annotations

import unicodedata
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.archives import write
from hypothesis import given, settings
from hypothesis import strategies as st
from submissions.hostile_class import Student, canvas_name, moodle_name

from grader.classroom import discovery, matching, roster
from grader.classroom.class_folder import ClassFacts, DoubtKind
from grader.classroom.identity import ANY, SHORT, Claim, identify
from grader.classroom.platform import HandIn
from grader.classroom.roster import Person

JANE = Person("s1", "Jane Doe", "jane@uni.edu", "jdoe", "", "101")
EVE = Person("s7", "Eve Adams", "eve@uni.edu", "eve", "Team 7", "707")


def found(root: Path, names: list[str], people: list[Person]) -> ClassFacts:
    """Find submissions with these names. Each is a file of its own, a name that ends in "/" a folder."""
    for number, name in enumerate(names):
        path = root / name
        if name.endswith("/"):
            path.mkdir(parents=True)
            path /= "package.zip"
        path.write_text(str(number))
    return discovery.find(root, people)


def submitted_by(root: Path, submitters: str) -> ClassFacts:
    """Find Gradescope's only submission with these submitters, in a class of Jane."""
    write(root, {"submission_metadata.yml": f"submission_1:\n  :submitters:\n{submitters}", "submission_1/a.py": ""})
    return discovery.find(root, [JANE])


def owners(result: ClassFacts) -> dict[str, list[str]]:
    """Return who has what, by what is handed in."""
    return {entry.path.read_text(): sorted(person.label for person in entry.people) for entry in result.entries}


@pytest.mark.parametrize(
    ("name", "person"),
    [
        ("王 小明", "李 小龍"),
        ("Иван Иванов", "Пётр Петров"),
        ("مريم علي", "فاطمة حسن"),
        ("Wei Li", "Li Wei"),
        ("Anna Marie Beck", "Marie Anna Beck"),
        ("Jose Nunez", "José Núñez"),
        ("Lukasz", "Łukasz"),
    ],
)
@pytest.mark.parametrize("pattern", ["{}.zip", "{}_5_assignsubmission_file_/"])
def test_another_name_is_another_person(tmp_path, pattern, name, person):
    """Names of other scripts were all equal, and so were two people whose words are the same in another order."""
    result = found(tmp_path, [pattern.format(name)], [Person("s8", person)])
    assert owners(result) == {"0": []}
    assert result.doubts[0].kind is DoubtKind.UNMATCHED


@pytest.mark.parametrize(
    ("name", "person"),
    [
        ("Sean OBrien", "Sean O'Brien"),
        ("Sean O\u2019Brien", "Sean O'Brien"),
        ("Sean O'Brien", "Sean O\u02bcBrien"),
        ("O'Brien, Sean", "Sean O'Brien"),
        ("sean_obrien", "Sean O'Brien"),
        (unicodedata.normalize("NFD", "José Núñez"), "José Núñez"),
        ("STRASSE", "Straße"),
        ("李 小龍", "李 小龍"),
        ("Doe, Jane", "Jane Doe"),
        ("Jane Doe", "Doe, Jane"),
    ],
)
def test_a_name_may_be_written_in_several_ways(tmp_path, name, person):
    result = found(tmp_path, [f"{name}.zip"], [Person("s8", person), Person("s9", "Bo Ek")])
    assert owners(result) == {"0": [person]}
    assert result.doubts == ()


@pytest.mark.parametrize("order", [1, -1])
def test_two_of_one_name_get_neither_submission_by_order(tmp_path, order):
    people = [Person("s1", "Jane Doe"), Person("s2", "Jane Doe")][::order]
    result = found(tmp_path, ["Jane Doe_5_assignsubmission_file_/", "Jane Doe_6_assignsubmission_file_/"], people)
    assert owners(result) == {"0": [], "1": []}
    kinds = [doubt.kind for doubt in result.doubts if not doubt.stops]
    assert kinds == [DoubtKind.AMBIGUOUS, DoubtKind.AMBIGUOUS]
    assert set(result.doubts[0].people) == set(people)


def test_two_accounts_of_one_name_are_not_both_the_one_person_of_the_roster(tmp_path):
    """The roster had one Jane Doe, the export two: both submissions were hers, and the better one counted."""
    result = found(
        tmp_path,
        ["Jane Doe_5_assignsubmission_file_/", "Jane Doe_6_assignsubmission_file_/"],
        [Person("s1", "Jane Doe"), Person("s2", "Bo Ek")],
    )
    assert owners(result) == {"0": [], "1": []}
    assert "accounts 5 and 6 have the name of Jane Doe" in result.doubts[0].what


def test_a_number_that_the_name_contradicts_decides_nothing(tmp_path):
    """The numbers of participants are others in each assignment; the roster may be of an earlier one."""
    people = [replace(JANE, lms="moodle"), Person("s2", "Bo Ek", lms_id="102", lms="moodle")]
    result = found(tmp_path, ["Bo Ek_101_assignsubmission_file_/", "Jane Doe_103_assignsubmission_file_/"], people)
    assert owners(result) == {"0": [], "1": []}
    whats = sorted(doubt.what for doubt in result.doubts if doubt.kind is DoubtKind.AMBIGUOUS)
    assert whats == [
        "Bo Ek is not certain: Moodle's number 101 is Jane Doe's, but the name is not.",
        "Jane Doe is not certain: the name is Jane Doe's, but Moodle's number 103 is not.",
    ]


def test_an_email_that_the_name_contradicts_decides_nothing(tmp_path):
    result = submitted_by(tmp_path, "  - :name: Jane Doe\n    :email: other@uni.edu\n")
    assert result.entries[0].people == ()
    assert "the name is Jane Doe's, but e-mail other@uni.edu is not" in result.doubts[0].what


def test_who_goes_by_another_name_is_known_by_id_or_email(tmp_path):
    result = submitted_by(tmp_path, "  - :name: Janie D.\n    :email: JANE@uni.edu\n")
    assert result.entries[0].people == (JANE,)


def test_a_submitter_whom_the_roster_does_not_have_is_a_doubt_though_the_others_are_known(tmp_path):
    result = submitted_by(tmp_path, "  - :email: jane@uni.edu\n  - :name: Zed\n    :email: zed@uni.edu\n")
    assert result.entries[0].people == (JANE,)
    assert [doubt.kind for doubt in result.doubts] == [DoubtKind.UNMATCHED]


# Moodle's groups: mod/assign/classes/downloader.php, and locallib.php before Moodle 4.1.


def test_a_groups_number_is_not_a_participants(tmp_path):
    """`Team 7_707` has the group's number 707; a participant of that number had the whole group's grade."""
    bo = Person("s2", "Bo Ek", lms_id="707", lms="moodle")
    result = found(tmp_path, ["Team 7_707_assignsubmission_file_/"], [replace(EVE, lms_id="9"), bo])
    assert owners(result) == {"0": ["Eve Adams"]}


@pytest.mark.parametrize("number", ["707", "999"])
def test_a_groups_name_before_a_members_is_read(tmp_path, number):
    roster_number = "707" if number == "707" else ""
    people = [replace(EVE, lms_id=roster_number), Person("s2", "Adams"), Person("s3", "Bo Ek", team="Team 8")]
    result = found(tmp_path, [f"Team 7-Eve Adams_{number}_assignsubmission_file_/"], people)
    assert owners(result) == {"0": ["Eve Adams"]}


def test_the_end_of_a_double_name_is_not_the_name(tmp_path):
    """`Anne-Marie Li` is not Marie Li of a group called Anne."""
    result = found(tmp_path, ["Anne-Marie Li_5_assignsubmission_file_/"], [Person("s1", "Marie Li")])
    assert owners(result) == {"0": []}
    assert result.doubts[0].people == (Person("s1", "Marie Li"),), "but somebody should look"


def test_the_default_group_is_those_whom_the_worksheet_says_are_in_it(tmp_path):
    people = [Person("s1", "Jane Doe", team="Default group"), EVE]
    result = found(tmp_path, ["Default group_assignsubmission_file_/", "Team 7_3_assignsubmission_file_/"], people)
    assert owners(result) == {"0": ["Jane Doe"], "1": ["Eve Adams"]}


def test_a_member_of_the_default_group_is_named_behind_it(tmp_path):
    names = ["Default group-Jane Doe_101_assignsubmission_file_/", "Standard-Gruppe-Bo Ek_9_assignsubmission_file_/"]
    result = found(tmp_path, names, [JANE, Person("s2", "Bo Ek")])
    assert owners(result) == {"0": ["Jane Doe"], "1": ["Bo Ek"]}


@pytest.mark.parametrize("word", ["Participant", "Teilnehmerin", "Participante"])
def test_a_hidden_name_is_nobodys_and_the_number_decides(tmp_path, word):
    people = [Person(lms_id="101", lms="moodle", id="s1"), Person(lms_id="102", lms="moodle", id="s2")]
    result = found(tmp_path, [f"{word}_101_assignsubmission_file_/", f"{word}_102_assignsubmission_file_/"], people)
    assert owners(result) == {"0": ["s1"], "1": ["s2"]}


# Canvas: lib/content_zipper.rb.


@pytest.mark.parametrize(
    ("person", "short"),
    [
        (Person(name="Jane Doe", sortable="Doe, Jane"), "doejane"),
        (Person(name="Jane Doe"), "doejane"),
        (Person(name="小龍 李", sortable="李, 小龍"), "李小龍"),
        (Person(name="Sean O'Brien", sortable="O'Brien, Sean"), "obriensean"),
        (Person(name="María del Carmen García", sortable="del Carmen García, María"), "delcarmengarcíamaría"),
        (Person(name="Пётр Иванов", sortable="Иванов, Пётр"), "ивановпётр"),
        (Person(name="रवि कुमार", sortable="कुमार, रवि"), "कुमाररवि"),
        (Person(name="Ann_Lee X", sortable="X, Ann_Lee"), "xann_lee"),
    ],
)
def test_canvas_short_names_are_made_by_its_own_rule_in_any_script(person, short):
    assert identify([Claim(SHORT, short)], [person]).people == (person,)


def test_where_two_have_one_short_name_only_the_number_decides(tmp_path):
    """`lian` is An Li and, without the space, Lian: only Canvas's number says who."""
    people = [
        Person("s1", "An Li", lms_id="11", lms="canvas", sortable="Li, An"),
        Person("s2", "Lian", lms_id="12", lms="canvas", sortable="Lian"),
    ]
    assert owners(found(tmp_path, ["lian_12_9_a.zip"], people)) == {"0": ["Lian"]}
    unknown = found(tmp_path, ["lian_12_9_a.zip"], [replace(who, lms_id="", lms="") for who in people])
    assert owners(unknown) == {"0": []}
    assert unknown.doubts[0].kind is DoubtKind.AMBIGUOUS


def test_a_short_name_of_another_order_is_not_the_persons(tmp_path):
    """`weili` is Li Wei; Wei Li would be `liwei`."""
    result = found(tmp_path, ["weili_5_9_a.zip"], [Person("s1", "Wei Li", sortable="Li, Wei")])
    assert owners(result) == {"0": []}


def test_a_participants_number_of_moodle_is_no_number_of_canvas(tmp_path):
    """A roster of Moodle beside an export of Canvas gave the submission of account 101 to participant 101."""
    result = found(tmp_path, ["ekbo_101_9_a.zip"], [replace(JANE, lms="moodle"), Person("s2", "Bo Ek")])
    assert owners(result) == {"0": ["Bo Ek"]}


def test_a_student_called_test_student_stays_in_the_class(tmp_path):
    path = tmp_path / "roster.csv"
    path.write_text('Student,ID,SIS User ID,SIS Login ID,Section\n"Student, Test",888,s8,tstudent,A\n')
    assert [person.id for person in roster.load(path)] == ["s8"]


# Names of people and of files, which students choose, and which may look like numbers of the platform.

MINE, THEIRS = Person("s1", "Ann Ek", lms_id="11111"), Person("s2", "Bo Li", lms_id="22222")
CANVAS = [replace(who, lms="canvas") for who in (MINE, THEIRS)]
POSING = replace(CANVAS[0], name="Bo Li_22222_7654321", sortable="Li, Bo_22222_7654321")
STEALS = {
    "canvas, by her name": (["boli_22222_7654321_11111_1234567_a.zip", "libo_22222_1234568_b.zip"], CANVAS),
    "canvas, by his name": (
        ["libo_22222_7654321_11111_1234567_a.zip", "libo_22222_1234568_b.zip"],
        [POSING, CANVAS[1]],
    ),
    "canvas, by her file's name": (["ekann_11111_1234567_22222_7654321_a.zip", "libo_22222_1234568_b.zip"], CANVAS),
    "moodle, a folder": (
        ["Bo Li_22222_assignsubmission_file__11111_assignsubmission_file_/", "Bo Li_22222_assignsubmission_file_/"],
        [replace(who, lms="moodle") for who in (MINE, THEIRS)],
    ),
    "moodle, a file": (
        [
            "Bo Li_22222_assignsubmission_file__11111_assignsubmission_file_a.zip",
            "Bo Li_22222_assignsubmission_file_b.zip",
        ],
        [replace(who, lms="moodle") for who in (MINE, THEIRS)],
    ),
}


@pytest.mark.parametrize("case", STEALS)
@pytest.mark.parametrize("known", ["with the platform's numbers", "by names", "no roster"])
def test_a_name_that_looks_like_somebody_elses_number_takes_nothing_from_them(tmp_path, case, known):
    """It replaced what the person with that number had handed in, with a note."""
    names, people = STEALS[case]
    people = {"by names": [replace(who, lms_id="", lms="") for who in people], "no roster": []}.get(known, people)
    result = found(tmp_path, names, people)
    theirs = [entry for entry in result.entries if entry.path.read_text() == "1"]
    assert [(who.id or "s2", who.lms_id or "22222") for entry in theirs for who in entry.people] == [("s2", "22222")]
    mine = [who for entry in result.entries if entry.path.read_text() == "0" for who in entry.people]
    assert all("11111" in (who.lms_id or "11111") and who.id in ("", "s1") for who in mine)
    if not mine:
        assert result.doubts
    if not mine and known != "by names" and "folder" not in case:  # of a folder the platform's number is certain
        assert DoubtKind.AMBIGUOUS in [doubt.kind for doubt in result.doubts if doubt.stops]


@pytest.mark.parametrize("people", [CANVAS, []])
def test_a_files_name_that_begins_with_a_number_is_no_doubt(tmp_path, people):
    names = ["ekann_11111_1234567_2_a.zip", "libo_22222_1234568_2024_robot.zip"]
    result = found(tmp_path, names, people)
    assert [len(who) for who in owners(result).values()] == [1, 1]
    assert result.doubts == ()


def test_a_file_named_after_a_long_number_is_whose_number_the_roster_has(tmp_path):
    """A student's number may have as many digits as Canvas's numbers of files."""
    names = ["ekann_11111_1234567_7654321_hw1.zip", "libo_22222_1234568_7654322_hw1.zip"]
    assert owners(found(tmp_path, names, CANVAS)) == {"0": ["Ann Ek"], "1": ["Bo Li"]}


# GitHub Classroom.


def test_unlinked_people_of_a_github_roster_keep_their_identifiers(tmp_path):
    """They had no login, no name and no id: one line of the gradebook for all of them."""
    path = tmp_path / "roster.csv"
    path.write_text(
        '"identifier","github_username","github_id","name"\n"s1001","anna","1","Anna"\n"s1002","","",""\n'
        '"li@uni.edu","","",""\n"Ek, Bo","","",""\n'
    )
    people = roster.load(path)
    assert [(who.id, who.email, who.name, who.login) for who in people] == [
        ("s1001", "", "Anna", "anna"),
        ("s1002", "", "", ""),
        ("", "li@uni.edu", "", ""),
        ("", "", "Bo Ek", ""),
    ]
    assert len({person.key for person in people}) == 4


def test_logins_that_all_begin_alike_are_found_whole(tmp_path):
    """What all names share was taken for the assignment's: `uni-anna` was looked for as `anna`."""
    people = [Person("s1", "Anna", login="uni-anna"), Person("s2", "Bob", login="uni-bob")]
    for person in people:
        (tmp_path / f"robots-{person.login}" / ".git").mkdir(parents=True)
        (tmp_path / f"robots-{person.login}" / "README.md").write_text(person.login)
    assert {entry.people for entry in discovery.find(tmp_path, people).entries} == {(who,) for who in people}


def test_a_login_with_hyphens_is_not_a_name_with_spaces(tmp_path):
    (tmp_path / "robots-submissions" / "robots-jane-doe" / ".git").mkdir(parents=True)
    (entry,) = discovery.find(tmp_path / "robots-submissions", [Person("s1", "Jane Doe", login="jd")]).entries
    assert entry.people == ()


# Any class.


def person(student: Student, *, lms: str = "", numbers: bool = True) -> Person:
    number = str(student.n) if lms and numbers else ""
    return Person(f"s{student.n}", student.name, lms_id=number, lms=lms if number else "", sortable=student.sortable)


LETTERS = st.characters(codec="utf-8", categories=("L", "M", "Nd"), include_characters=" '-.\u2019")
NAMES = st.one_of(
    st.sampled_from(
        ["Li", "Wei", "Anna", "Marie", "Anna-Marie", "O'Brien", "OBrien", "李", "小龍", "王", "Müller", "Mu"]
    ),
    st.text(LETTERS, min_size=1, max_size=6),
).filter(lambda text: text.strip())
CLASSES = st.lists(st.tuples(NAMES, NAMES), min_size=1, max_size=8).map(
    lambda names: [Student(number, given.strip(), family.strip()) for number, (given, family) in enumerate(names, 11)]
)


def hand_in(platform: str, student: Student) -> HandIn:
    number = str(student.n)
    claims = {
        "moodle": (
            Claim("lms_id", number, "moodle"),
            *(Claim(kind, moodle_name(student)) for kind in ("name", "team")),
        ),
        "canvas": (Claim("lms_id", number, "canvas"), Claim(SHORT, canvas_name(student))),
        "plain": (Claim(ANY, student.name),),
    }[platform]
    return HandIn(Path(number), student.given, (claims,))


def matched(hand_ins: list[HandIn], people: list[Person]) -> dict[str, set[Person]]:
    return {found.hand_in.path.name: set(found.people) for found in matching.match(hand_ins, people)}


@settings(max_examples=150)
@given(
    students=CLASSES,
    numbers=st.booleans(),
    platform=st.sampled_from(["moodle", "canvas", "plain"]),
    mixed=st.randoms(use_true_random=False),
)
def test_no_submission_is_ever_matched_with_another_person(students, numbers, platform, mixed):
    """For any class, with names in any script and namesakes; and the order of nothing matters."""
    people = [person(student, lms="" if platform == "plain" else platform, numbers=numbers) for student in students]
    hand_ins = [hand_in(platform, student) for student in students]
    before = matched(hand_ins, people)
    for student, who in zip(students, people, strict=True):
        assert before[str(student.n)] <= {who}
        if numbers and platform != "plain":
            assert before[str(student.n)] == {who}, "the platform's own number decides"
    mixed.shuffle(people)
    mixed.shuffle(hand_ins)
    assert matched(hand_ins, people) == before


@settings(max_examples=100)
@given(students=CLASSES, kept=st.integers(min_value=1, max_value=255), platform=st.sampled_from(["moodle", "canvas"]))
def test_who_is_not_in_the_roster_is_none_of_the_people_in_it(students, kept, platform):
    """With the platform's numbers in the roster: a namesake of somebody in it is still somebody else."""
    people = [person(student, lms=platform) for student in students if kept >> (student.n - 11) & 1]
    if people:
        for number, found_people in matched([hand_in(platform, student) for student in students], people).items():
            assert {who.lms_id for who in found_people} <= {number}
