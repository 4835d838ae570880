"""The texts of the checkpoints: the last one is the reference, and what is packed for students is the same."""

from __future__ import annotations

import json
import zlib

import pytest
from helpers.course import REFERENCE

from grader.authoring import checkpoint_texts
from grader.courses.robot_controller.patients import patients
from grader.errors import GraderError
from grader.notebook import checkpoints


def reference_files() -> dict[str, str]:
    return {
        str(path.relative_to(REFERENCE)): path.read_text()
        for path in REFERENCE.rglob("*")
        if path.is_file() and not path.name.startswith(".") and not {"__pycache__", ".pytest_cache"} & set(path.parts)
    }


def test_each_file_of_the_reference_is_written_once_in_its_final_version():
    reference = reference_files()
    written = [
        path
        for name in list(checkpoints.table())
        for path, text in checkpoint_texts.texts(name).items()
        if text == reference[path]
    ]
    assert sorted(written) == sorted(reference)


def test_the_last_notebook_leaves_the_reference():
    assert checkpoints.files_after("10") == reference_files()


def test_the_first_package_has_no_interfaces_and_the_second_has():
    assert "rosidl" not in checkpoint_texts.solution("01", "CMakeLists.txt")
    assert "rosidl" not in checkpoint_texts.solution("01", "package.xml")
    assert checkpoint_texts.solution("02", "CMakeLists.txt") == (REFERENCE / "CMakeLists.txt").read_text()


def test_an_edit_that_no_longer_fits_the_reference_says_so():
    with pytest.raises(GraderError, match=r"An edit of CMakeLists.txt fits the solution 0 times, not once: 'find_pa"):
        checkpoint_texts.edited("find_package(rclpy)", [{"old": "find_package(nothing)", "new": ""}], "CMakeLists.txt")


@pytest.mark.parametrize("name", list(checkpoints.table()))
def test_given_modules_have_ninety_nine_columns_at_most_and_end_in_one_line_break(name: str):
    for path, text in checkpoint_texts.given_texts(name).items():
        assert text.endswith("\n"), path
        assert not text.endswith("\n\n"), path
        if path.endswith(".py"):
            assert max(map(len, text.splitlines())) <= 99, path
            compile(text, path, "exec")


def test_the_packed_texts_are_those_of_the_checkout():
    packed = json.loads(zlib.decompress(checkpoint_texts.pack()))
    made = {key: checkpoint_texts.texts(key) for key in [*checkpoints.table(), *patients.cases()]}
    del made[max(checkpoints.table())]
    assert packed == json.loads(json.dumps({key[:2] if key in checkpoints.table() else key: made[key] for key in made}))
