"""The folder that `nbgrader collect` leaves is a class as it is; docs/course.md says how to make its roster."""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from helpers.course import COURSE

from grader import KIT, cli
from grader.intake.submission import open_submission

PAGE = KIT / "docs" / "course.md"


@pytest.fixture
def submitted(tmp_path: Path) -> Path:
    """Return a collected folder: Anna has handed in a zip, Bela the package's folder a day and a half too late."""
    folder = tmp_path / "submitted"
    for student, time in (("anna", "2026-11-20 12:00:00.123456 UTC"), ("bela", "2026-11-22 12:00:00.123456 UTC")):
        (folder / student / "robots").mkdir(parents=True)
        (folder / student / "robots" / "timestamp.txt").write_text(f"{time}\n")
        shutil.copy(KIT / "notebooks" / "01_anatomy.ipynb", folder / student / "robots")
    shutil.make_archive(
        str(folder / "anna" / "robots" / COURSE.package), "zip", COURSE.solution.parent, COURSE.solution.name
    )
    shutil.copytree(COURSE.solution, folder / "bela" / "robots" / COURSE.package)
    (roster,) = re.findall(r"```sh\n(\(echo login.*?)```", PAGE.read_text(), re.DOTALL)
    subprocess.run(["sh", "-c", roster], cwd=tmp_path, check=True)
    return folder


def test_a_collected_folder_has_its_students_and_their_times(submitted: Path, tmp_path: Path):
    words = ["--roster", str(tmp_path / "roster.csv"), "--deadline", "2026-11-20T23:59+00:00"]
    words += ["--late", "10 % per started day", "--out", str(tmp_path / "class"), "--plan"]
    assert cli.main(["batch", str(submitted), *words]) == 0
    with (tmp_path / "class" / "plan.csv").open(encoding="utf-8") as stream:
        anna, bela = csv.DictReader(stream)
    assert (anna["people"], anna["matched by"], anna["late"]) == ("anna", "login anna", "in time")
    assert (bela["people"], bela["late"]) == ("bela", "late by 36:01:00, 2 started days")


@pytest.mark.parametrize("student", ["anna", "bela"])
def test_the_package_is_found_beside_the_notebooks(student: str, submitted: Path, tmp_path: Path):
    taken = open_submission(submitted / student, tmp_path / "taken", COURSE)
    assert (taken.package / "package.xml").is_file()
    assert taken.flags == ()
