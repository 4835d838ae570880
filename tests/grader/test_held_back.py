"""A requirement that is held back: what students get says that it is judged at hand-in, and tells nothing else of it.

The course is the small one beside the kit's own, with a requirement X1 whose trial, check and world are in held_back/.
"""

from __future__ import annotations

import base64
import io
import json
import re
import shutil
import zipfile
import zlib
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import beside

from grader import KIT, cli, evidence, pipeline, report
from grader.authoring import check_course
from grader.authoring.release import TOP
from grader.checks import checks_run
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Entry, Record, Status
from grader.classroom.roster import Person
from grader.course import Course, load
from grader.course.reader import VARIABLE
from grader.evidence import (
    Build,
    Call,
    Command,
    Evidence,
    Flag,
    Intake,
    Kind,
    Message,
    ProcessEnd,
    Reason,
    Sample,
    Touch,
    Trial,
)
from grader.notebook import checking, packing
from grader.notebook.workspace import Workspace
from grader.report import console, html
from grader.scoring import rubric
from grader.scoring.grading import Grading
from grader.scoring.scorecard import CheckResult, Outcome
from grader.trials import catalog, worker
from grader.trials.request import TrialRequest
from grader.trials.what_ran import Notes

TEXTS = beside(__file__)

HALL = KIT / "grader" / "authoring" / "template_course"
BYTE_CODE = shutil.ignore_patterns("__pycache__")  # it would pass for that of an edit of the same size and second
SECRETS = (
    "past_the_alcove", "check_alcove", "test_keeps_off_the_alcove", "alcove_hall", "alcove.py", "alcove_post",
    "A hall with an alcove", "3.1347", "0.3173", "1.7171", "918273", "alcove",
)  # fmt: skip


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Course:
    folder = tmp_path_factory.mktemp("course") / "hall_guard"
    shutil.copytree(HALL, folder, ignore=BYTE_CODE)
    text = (folder / "rubric.yaml").read_text()
    text = text.replace("\n  - id: package\n", "\n" + TEXTS["ENTRY"], 1)
    (folder / "rubric.yaml").write_text(text)
    for name, content in {
        "trials/alcove.py": TEXTS["TRIAL"],
        "checks/check_alcove.py": TEXTS["CHECK"],
        "worlds/alcove_hall.yaml": TEXTS["WORLD"],
    }.items():
        (folder / "held_back" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "held_back" / name).write_text(content)
    return load(folder)


@pytest.fixture
def here(course: Course, monkeypatch: pytest.MonkeyPatch) -> Course:
    monkeypatch.setenv(VARIABLE, str(course.folder))
    return course


def told(content: bytes, name: str = "") -> list[str]:
    """Return the secrets that a file tells, also packed inside it."""
    texts = [f"{name}\n".encode() + content]
    if zipfile.is_zipfile(io.BytesIO(content)):
        with zipfile.ZipFile(io.BytesIO(content)) as inner:
            texts += [f"{member} {told(inner.read(member), member)}".encode() for member in inner.namelist()]
    if name.endswith(".bin"):
        texts.append(zlib.decompress(content))
    if name == "classroom.txt":
        texts.append(base64.b64decode(content.removeprefix(b"result=")))
    return [secret for secret in SECRETS for text in texts if secret.encode() in text]


# -- the course --------------------------------------------------------------------------------------------------------


def test_what_is_held_back_is_part_of_the_course(course: Course):
    assert catalog.trials(course)["past_the_alcove"].serves == ("X1",)
    assert Path(course.world("alcove_hall")).is_file()
    whole = rubric.load(course.rubric, checks_run.known(course))
    assert whole.requirement("X1").held_back


# -- the release -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def kit(course: Course, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("kit") / "kit.zip"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, "")
        assert cli.main(["release", "--course", str(course.folder), "--out", str(path)]) == 0
    return path


def test_a_released_kit_tells_nothing_of_it(kit: Path):
    with zipfile.ZipFile(kit) as members:
        found = {name: said for name in members.namelist() if (said := told(members.read(name), name))}
        entry = members.read(f"{TOP}/hall_guard/rubric.yaml").decode()
        handout = members.read(f"{TOP}/docs/handout.md").decode()
    assert not found
    assert "Keeps its distance" in entry
    assert "- **X1** (10, judged at hand-in) It keeps its distance from whatever stands in the hall." in handout


def test_the_search_finds_what_a_kit_would_tell(tmp_path: Path):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as inner:
        inner.writestr("a.txt", "at 0.3173 m")
    assert told(packed.getvalue(), "x.zip") == ["0.3173"]
    assert told(zlib.compress(b"alcove_post"), "checkpoints.bin") == ["alcove_post", "alcove"]


def test_the_released_rubric_has_the_points_and_no_checks(kit: Path, tmp_path: Path):
    with zipfile.ZipFile(kit) as members:
        (tmp_path / "rubric.yaml").write_bytes(members.read(f"{TOP}/hall_guard/rubric.yaml"))
    found = rubric.load(tmp_path / "rubric.yaml")
    assert (found.requirement("X1").points, found.requirement("X1").checks) == (10, ())
    assert found.requirement("B3").checks


MISPLACED = (
    ("held_back/trials/alcove.py", '["X1"]', '["X1", "B3"]', "past_the_alcove .* only some are held back"),
    ("held_back/trials/alcove.py", '["X1"]', '["B3"]', "past_the_alcove in held_back/trials/ serves B3; move it"),
    ("trials/patrol.py", '["B3"]', '["X1"]', "to_the_end in trials/ serves X1; move it to held_back/trials/"),
    ("rubric.yaml", "held_back: true", "held_back: false", "held_back/checks/check_alcove.py judges X1"),
    ("rubric.yaml", "check_alcove::test_keeps_off_the_alcove", "check_wall::test_stops_before_the_wall",
     "check_wall::test_stops_before_the_wall is listed twice"),
    ("rubric.yaml", "check_alcove::test_keeps_off_the_alcove", "check_wall::test_touches_nothing",
     "checks/check_wall.py judges X1; move it to held_back/checks/"),
)  # fmt: skip
TOLD = (
    ("checks/check_wall.py", '"to_the_end"', '"past_the_alcove"', "check_wall.py names past_the_alcove"),
    ("trials/patrol.py", 'world="hall"', 'world="alcove_hall"', "patrol.py names alcove_hall"),
    ("held_back/trials/alcove.py", 'world="alcove_hall"', 'world="yard"', "only trials .*worlds/yard.yaml"),
    ("notebooks/01_guard.ipynb", "The simulated hall", "alcove_hall, the hall", "ipynb names alcove_hall"),
)


@pytest.fixture
def changed(course: Course, tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Return the course with a change: a file, the old text and the new one."""
    folder, (file, old, new) = tmp_path / "hall_guard", request.param
    shutil.copytree(course.folder, folder, ignore=BYTE_CODE)
    (folder / "worlds" / "yard.yaml").write_text((folder / "worlds" / "hall.yaml").read_text())
    check = folder / "checks" / "check_wall.py"
    check.write_text(f"{check.read_text()}\n\ndef test_touches_nothing(judge):\n    pass\n")
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    return folder


@pytest.mark.parametrize(("changed", "words"), [(case[:3], case[3]) for case in MISPLACED + TOLD], indirect=["changed"])
def test_a_file_in_the_wrong_folder_is_named_and_nothing_is_released(
    changed: Path, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setenv(VARIABLE, "")
    assert cli.main(["release", "--course", str(changed), "--out", str(tmp_path / "kit.zip")]) == 3
    said = capsys.readouterr().err
    assert re.search(words, said), said
    assert not (tmp_path / "kit.zip").exists()
    if words in [case[3] for case in MISPLACED]:
        assert any(re.search(words, mistake) for mistake in check_course.mistakes(changed))


# -- what students read of a grading -----------------------------------------------------------------------------------


def sample(t: float) -> Sample:
    return Sample(t, 0.25 * t, 0.0, 0.0, 0.25, 0.0, 0.25 * t, 0.0, 0.0, 0.5)


def trial(name: str, world: str, touch: Touch) -> Trial:
    """Return a trial that can be drawn and replayed, in which something was touched."""
    scene = {"title": world, "walls": [{"name": "end", "start": [3.1347, -2.0], "end": [3.1347, 2.0]}]}
    samples = [sample(0.1 * step) for step in range(60)]
    return Trial(
        name, "guard", world, 918273, True, "lockstep", None, samples=samples, scene=scene,
        commands=[Command(0.5, 0.25, 0.0)], calls=[Call(0.1, "patrol", {}, {"success": True})], touches=[touch],
    )  # fmt: skip


def graded(course: Course, folder: Path, secret: Trial) -> Path:
    """Return the folder with the reports on a submission that touched something in the trials of B3 and X1."""
    public = trial("to_the_end", "hall", Touch(7.25, "end", 0.2))
    build = Build(True, False, 1.0, 0, False, "", package="hall_guard")
    flag = Flag("foreign publisher", "something else published /clock", trial="to_the_end, past_the_alcove")
    trials = {public.name: public, secret.name: secret}
    found = Evidence(
        Intake("team01.zip", "0" * 64, "hall_guard", "."), build, trials=trials,
        flags=[flag, replace(flag, trial=secret.name)], kept={"trial past_the_alcove": "2026-11-20 10:00"},
        origin={"course": str(course.folder)},
    )  # fmt: skip
    evidence.save(found, folder / pipeline.EVIDENCE)
    whole = rubric.load(course.rubric)
    others = [check for r in whole.requirements if r.id not in ("B3", "X1") for check in r.checks]
    passed = [CheckResult(check.id, Outcome.PASSED, 1.0) for check in others]
    settings = pipeline.Settings(whole, folder, course, seed=918273)
    report.write(pipeline.judge(folder / pipeline.EVIDENCE, settings, passed), folder)
    return folder


TOUCHED = trial("past_the_alcove", "alcove_hall", Touch(6.5, "alcove_post", 0.2))
DIED = replace(
    TOUCHED, touches=[], ended=Reason(Kind.DIED, seconds=3.1347, exit_code=31),
    process=ProcessEnd("itself", 31, 1.0, 'scan 1.7171 alcove\n  File "alcove.py", line 31, in f\nKeyError: 0.3173\n'),
)  # fmt: skip


@pytest.fixture(scope="module")
def touched(course: Course, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return graded(course, tmp_path_factory.mktemp("graded"), TOUCHED)


def test_a_students_report_says_the_points_and_not_what_was_seen_in_words_pictures_or_flags(touched: Path):
    own = touched / "for_student"
    page, said = (own / "report.html").read_text(), json.loads((own / "report.json").read_text())
    assert {path.name: told(path.read_bytes(), path.name) for path in own.iterdir()} == {
        "report.html": [],
        "report.json": [],
    }
    assert "not shown: the requirement is held back" in page
    assert "It keeps its distance from whatever stands in the hall." in page
    assert "touched end at 7.2 s" in page, "what is not held back is said as ever"
    assert page.count("data-replay=") == 1
    (requirement,) = [each for each in said["requirements"] if each["id"] == "X1"]
    assert (requirement["points"], requirement["outcome"], requirement["max"]) == (0.0, "failed", 10.0)
    assert [flag["trial"] for flag in said["integrity"]] == ["to_the_end"]
    instructors = (touched / "report.html").read_text()
    assert "touched alcove_post at 3.1347 m" in instructors
    assert instructors.count("data-replay=") == 2


IN_WORDS = "wall ahead at three point two metres"
SAYS = replace(TOUCHED, touches=[], calls=[Call(0.1, "patrol", {}, {"message": IN_WORDS})])
LOGS = replace(TOUCHED, touches=[], calls=[], messages=[Message(1.0, "rosout", {"msg": IN_WORDS})])
ENDS = replace(DIED, ended=Reason(Kind.HANGS, seconds=10.0, place=f"{IN_WORDS}.py:7, in `three`", nodes=(IN_WORDS,)))


@pytest.mark.parametrize(
    ("secret", "words"),
    [(SAYS, IN_WORDS), (LOGS, IN_WORDS), (ENDS, IN_WORDS), (DIED, "KeyError")],
    ids=["a service", "the log", "the names of its files", "a traceback"],
)
def test_what_a_node_says_in_words_is_not_quoted(course: Course, tmp_path: Path, secret: Trial, words: str):
    """Only digits and names were hidden."""
    own = graded(course, tmp_path, secret) / "for_student"
    assert words in (tmp_path / "report.json").read_text()
    for path in own.iterdir():
        assert not re.search("wall ahead|at three|three point|two metres|KeyError", path.read_text()), path.name
        assert not told(path.read_bytes())


def test_where_a_sandboxes_files_come_from_does_not_name_the_trial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A node can read it in /proc/self/mountinfo."""
    monkeypatch.setattr(
        worker.parameter_files, "write_changed", lambda _share, out, *_: ({out / "a.yaml": "a.yaml"}, {})
    )
    plan = replace(catalog.trials(load(HALL))["file_guard"], name="past_the_alcove")
    request = TrialRequest(
        plan.name, str(tmp_path / "install"), 0, 7, str(tmp_path / f"{plan.name}.json"), ros_name="x"
    )
    with closing(Notes(tmp_path)) as notes:
        box, _ = worker._sandbox(load(HALL), plan, request, notes)
    assert any(path.name == "a.yaml" for path in box.read_only)
    assert not any("alcove" in str(path) for path in box.read_only)


@pytest.mark.slow  # a report more
def test_a_report_without_anything_held_back_has_no_second_page(course: Course, touched: Path, tmp_path: Path):
    """The page for students stayed there when a rubric no longer held anything back."""
    shutil.copytree(touched, tmp_path / "again")
    settings = pipeline.Settings(rubric.load(HALL / "rubric.yaml"), tmp_path, load(HALL), requirements=("B3",))
    report.write(pipeline.judge(tmp_path / "again" / pipeline.EVIDENCE, settings), tmp_path / "again", pictures=False)
    assert not (tmp_path / "again" / "for_student").exists()


# -- platforms ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def a_class(course: Course, touched: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a class with that submission, of one person."""
    made, whole = ClassFolder(tmp_path_factory.mktemp("made") / "class"), rubric.load(course.rubric)
    made.path.mkdir()
    (made.path / RUBRIC).write_text(course.rubric.read_text())
    jane = Person("s1", "Jane Doe", "jane@example.org", lms_id="12345", lms="moodle")
    entry = Entry("team01", "team01", Path("doejane_12345_6789_team.zip"), "a" * 64, (jane,))
    facts = ClassFacts("Guard", "x", "plain", whole.sha256, "k", "0", "", 918273, (entry,), course=str(course.folder))
    made.write_facts(facts)
    new = made.working("team01")
    shutil.copytree(touched, new, dirs_exist_ok=True)
    made.keep(new, Record("team01", Status.GRADED, content=entry.content, rubric=whole.sha256, seed=918273))
    return made.path


SHEETS = {
    "moodle": "Identifier,Full name,Grade,Last modified (grade),Feedback comments\nParticipant 12345,Jane Doe,,-,\n",
    "canvas": 'Student,ID,SIS User ID,Robots (77)\n"Doe, Jane",,s1,\n',
}


@pytest.mark.parametrize("platform", ["moodle", "canvas", "gradescope", "github", "csv"])
def test_what_a_platform_gets_tells_nothing_of_it(platform: str, a_class: Path, tmp_path: Path):
    sheet = ["--sheet", str(a_class / "sheet.csv")] if platform in SHEETS else []
    (a_class / "sheet.csv").write_text(SHEETS.get(platform, ""))
    assert cli.main(["gradebook", str(a_class), "--for", platform, "--out", str(tmp_path / "grades"), *sheet]) == 0
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert written
    assert {path.name: said for path in written if (said := told(path.read_bytes(), path.name))} == {}


def test_a_grading_of_its_own_tells_a_platform_nothing_of_it(
    touched: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """In another folder than the course's it was read by the kit's rubric."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(["gradebook", str(touched), "--for", "gradescope", "--out", str(tmp_path)]) == 0
    (found,) = tmp_path.rglob("results.json")
    assert not told(found.read_bytes())
    assert "not shown: the requirement is held back" in json.dumps(json.loads(found.read_text()), ensure_ascii=False)


# -- a student's checks ------------------------------------------------------------------------------------------------


@pytest.fixture
def students(here: Course, kit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    """Return the course as the released kit has it."""
    with zipfile.ZipFile(kit) as members:
        members.extractall(tmp_path / "kit")
    folder = tmp_path / "kit" / TOP / "hall_guard"
    monkeypatch.setenv(VARIABLE, str(folder))
    return load(folder)


def test_a_check_in_a_terminal_says_that_it_is_judged_at_hand_in(students: Course, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["check", "X1", "--package", str(HALL / "solution" / "hall_guard")]) == 0
    assert capsys.readouterr().out == "X1 is judged at hand-in, not here (10 points).\n"


def stub(course: Course, requirements: tuple[str, ...]) -> Grading:
    """Return a grading in which every check of these requirements passed."""
    whole = rubric.load(course.rubric)
    asked = [r for r in whole.requirements if not requirements or r.id in requirements]
    passed = [CheckResult(check.id, Outcome.PASSED, 1.0) for r in asked for check in r.checks]
    settings = pipeline.Settings(whole, Path(), course, requirements=requirements)
    found = Evidence(Intake("x", "0", "hall_guard", "."), Build(True, False, 1.0, 0, False, "", package="hall_guard"))
    return pipeline._scored(found, settings, passed)


def test_a_check_of_everything_counts_what_can_be_judged_here(
    students: Course, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(pipeline, "grade", lambda _package, _out, settings: stub(students, settings.requirements))
    assert cli.main(["check", "--package", str(HALL / "solution" / "hall_guard")]) == 0
    *_, last = capsys.readouterr().out.splitlines()
    assert last == "100 of 100 points that can be judged here. Judged at hand-in, not here: X1 (10 points)."


@pytest.mark.parametrize("where", ["students", "here"])
def test_a_check_in_a_notebook_says_so_whoever_runs_it(
    where: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    """The outputs of a notebook that an instructor has run are released with it."""
    course = request.getfixturevalue(where)
    monkeypatch.setattr(checking, "course", lambda: course)
    monkeypatch.setattr(checking.prerequisites, "first_gap", lambda *_: None)
    monkeypatch.setattr(checking, "_grade", lambda _p, _w, wanted, *_, **__: stub(course, tuple(r.id for r in wanted)))
    monkeypatch.setattr(checking.prerequisites, "stand_in", lambda *_: None)
    monkeypatch.setattr(checking.prerequisites, "later", lambda *_: None)
    room = Workspace(tmp_path)
    assert repr(checking.check(room, ["X1"])) == "X1 is judged at hand-in, not here (10 points)"
    assert "is judged at hand-in" in checking.check(room, ["X1"])._repr_html_()
    whole = checking.check(room, [])
    assert "X1" not in [answer.id for answer in whole.answers]
    assert whole.notes[-1] == "100 of 100 points that can be judged here. Judged at hand-in, not here: X1 (10 points)."


def test_submit_names_what_is_judged_later_and_counts_the_rest(students: Course):
    packed = packing.PackedSubmission(Path("x.zip"), {}, (), (), (), grading=stub(students, ()))
    said = str(packed)
    assert "100 of 100 that can be judged here\n  Judged at hand-in, not here: X1 (10 points)." in said


def test_a_grading_in_the_students_kit_says_judged_at_hand_in_not_by_a_person(students: Course):
    grading = stub(students, ())
    for text in (console.render(grading), html.render(grading)):
        assert "judged at hand-in: X1" in text
        assert "by a person" not in re.sub(r"(?s)<style.*?</style>", "", text)
