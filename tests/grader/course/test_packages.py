"""What a submission can import: what the kit has, and what a course adds in extra-requirements.txt."""

from __future__ import annotations

import shutil
from importlib import metadata
from pathlib import Path

import pytest

from grader import KIT, building, cli, pipeline
from grader.authoring import package_edits
from grader.checks import check_package_xml
from grader.checks.judge import Judge
from grader.course import Course, handout, load, packages
from grader.errors import GraderError
from grader.evidence import Build, Evidence, Intake, Manifest, Quality
from grader.host import doctor
from grader.scoring import rubric

HALL = KIT / "grader" / "authoring" / "template_course"
SOUP = metadata.version("beautifulsoup4")  # the kit has it for itself; Python calls it bs4


def course(folder: Path, extra: str) -> Course:
    """Return the small course with these extra requirements."""
    shutil.copytree(HALL, folder / "hall_guard", ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "hall_guard" / packages.EXTRA).write_text(extra)
    return load(folder / "hall_guard")


def test_the_handout_lists_what_a_package_may_import(tmp_path: Path):
    found = course(tmp_path, f"beautifulsoup4=={SOUP}\nscipy==1.14.1  # for filters\n")
    page = handout.render(rubric.load(found.rubric), found)
    assert f"`bs4` (beautifulsoup4 {SOUP})" in page
    assert "`scipy` 1.14.1" in page
    assert "`numpy` 2." in page
    assert "`yaml` (pyyaml" in page
    assert "`geometry_msgs`" in page
    assert "launch" not in page, "the course has no launch files"


def test_pins_may_have_hashes_comments_and_markers(tmp_path: Path):
    text = (
        "# locked\nscipy==1.14.1 \\\n    --hash=sha256:00ff \\\n    --hash=sha256:11ff\n\n"
        "transforms3d==0.4.2 ; python_version >= '3'\nold==1.0 ; python_version < '3'\n"
    )
    found = packages.extra(course(tmp_path, text))
    assert [(each.name, each.version) for each in found] == [("scipy", "1.14.1"), ("transforms3d", "0.4.2")]


@pytest.mark.parametrize("line", ["scipy", "scipy>=1.10", "scipy==1.*", "-r other.txt", "scipy==1.1,<2"])
def test_a_line_without_one_version_is_named_with_its_place(line: str, tmp_path: Path):
    found = course(tmp_path, f"numpy==2.0.0\n{line}\n")
    with pytest.raises(GraderError, match=r"extra-requirements.txt, line 2: .*name==1\.2\.3"):
        packages.extra(found)


def test_what_is_not_installed_is_named_with_the_line_that_installs_it(tmp_path: Path):
    found = course(tmp_path, "no-such-package==1.0\nbeautifulsoup4==0.1\n")
    with pytest.raises(GraderError) as error:
        packages.require(found)
    said = (
        f"no-such-package 1.0 is not installed; beautifulsoup4 0.1 is not installed, but {SOUP}. Run: .venv/bin/python"
    )
    assert f"{said} -m pip install --no-deps -r {found.folder}/extra-requirements.txt" in str(error.value)
    assert doctor.of_course("", "") == []
    (diagnosis,) = doctor.of_course(packages.missing(found), packages.install_line(found))
    assert (diagnosis.state, diagnosis.fix) == (doctor.State.BAD, packages.install_line(found))


def test_what_an_added_package_needs_itself_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    library = tmp_path / "site" / "arm_tools-1.0.dist-info"
    library.mkdir(parents=True)
    (library / "METADATA").write_text("Metadata-Version: 2.1\nName: arm-tools\nVersion: 1.0\nRequires-Dist: numpy<1\n")
    monkeypatch.syspath_prepend(library.parent)
    missing = packages.missing(course(tmp_path, f"arm-tools==1.0\nbeautifulsoup4=={SOUP}\n"))
    assert missing == "arm-tools needs numpy<1, which is not here; add a line for it"


def test_nothing_is_graded_while_an_added_package_is_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """It would cost students the points of every node that imports it."""
    found = course(tmp_path, "no-such-package==1.0\n")
    out = tmp_path / "out"
    assert cli.main(["grade", str(found.solution), "--course", str(found.folder), "--out", str(out)]) == 3
    assert "no-such-package 1.0 is not installed" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("extra", "points"), [(f"beautifulsoup4=={SOUP}\n", 1.0), ("", 0.8)], ids=["added by the course", "not added"]
)
def test_an_added_package_may_be_declared_by_its_own_name(extra: str, points: float, tmp_path: Path):
    """package.xml said python3-beautifulsoup4, and I2 missed bs4."""
    used = {"bs4": ["hall_guard/guard.py:3"]}
    declared = ["python3-beautifulsoup4"]
    manifest = Manifest(found=True, format="3", declared=declared, declared_to_run=declared, used=used)
    build = Build(True, False, 1.0, 0, False, "")
    evidence = Evidence(Intake("x", "0", "x", "."), build, quality=Quality(manifest))
    judge = Judge(evidence, course(tmp_path, extra))
    check_package_xml.test_every_package_used_is_declared(judge)
    assert judge.fraction == pytest.approx(points)


@pytest.mark.slow  # a build and a trial
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_node_can_import_what_the_course_adds(tmp_path: Path):
    found = course(tmp_path, f"beautifulsoup4=={SOUP}\n")
    package = package_edits.copy(found.solution, tmp_path / "student")
    package_edits.replace("hall_guard/guard.py", "import math\n", "import math\n\nimport bs4\n")(package)
    settings = pipeline.Settings(rubric.load(found.rubric), building.cache_folder(), found, requirements=("B1",))
    assert pipeline.grade(package, tmp_path / "out", settings).scorecard.points == 10
