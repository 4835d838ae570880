"""A course's folder is read once; each mistake is named with its file, its line and the nearest name."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from helpers.course import COURSE

from grader.course import load
from grader.errors import GraderError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the contract of the kit's own course, with its rubric beside it."""
    shutil.copytree(COURSE.folder / "contract", tmp_path / "course" / "contract")
    shutil.copy(COURSE.rubric, tmp_path / "course" / "rubric.yaml")
    (tmp_path / "course" / "course.yaml").write_text(f"title: x\npackage: {COURSE.package}\nrubric: rubric.yaml\n")
    return tmp_path / "course"


def test_a_copied_course_has_the_same_contract(folder: Path):
    found = load(folder)
    assert (found.nodes, found.layout, found.offered) == (COURSE.nodes, COURSE.layout, COURSE.offered)
    assert found.requirement_of("check_build") == "I1"


@pytest.mark.parametrize(
    ("file", "old", "new", "why"),
    [
        ("contract/contract.yaml", "srv/SetSpeed,", "srv/SetSpeeds,", "line [0-9]+: srv/SetSpeed is not one of the"),
        ("contract/contract.yaml", "subscribes: {scan", "subscribe: {scan", "Did you mean subscribes"),
        ("contract/contract.yaml", "answers_on: cmd_vel", "answers_on: cmd_vle", "Did you mean cmd_vel"),
        ("contract/contract.yaml", "telltale: 0.375,", "telltale: fast,", "fast is not a number"),
        ("course.yaml", "rubric.yaml", "rubrik.yaml", "line 3: there is no .*rubrik.yaml"),
        ("course.yaml", "title: x", "title: x\nlanguage: deu", "line 2: deu is not a language .* Did you mean de"),
        ("course.yaml", "title: x", "titel: x", "line 1: titel is not allowed here. Did you mean title"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_place(folder: Path, file: str, old: str, new: str, why: str):
    text = (folder / file).read_text()
    assert text.count(old) >= 1
    (folder / file).write_text(text.replace(old, new, 1))
    with pytest.raises(GraderError, match=why):
        load(folder)


def test_a_folder_without_a_course_says_what_it_needs(tmp_path: Path):
    with pytest.raises(GraderError, match="A course needs course"):
        load(tmp_path)
