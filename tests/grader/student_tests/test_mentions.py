"""What a test mentions to look behind the package or the grader is told, file and line; honest tests mention none."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader import KIT
from grader.evidence import Flag
from grader.student_tests.mentions import mentions

REFERENCE = KIT / "solution_pkg/ros2_robot_controller"


def told(folder: Path, text: str) -> list[Flag]:
    (folder / "test").mkdir()
    (folder / "test/test_it.py").write_text(text)
    return mentions(folder)


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("print(f.__code__)", "__code__"),
        ("print(x.co_code, 1)", "co_code"),
        ("print(x.co_consts)", "co_consts"),
        ("import marshal", "marshal"),
        ("from dis import dis", "dis"),
        ("inspect.getsource(f)", "getsource"),
        ("from inspect import getsource", "inspect.getsource"),
        ("ast.parse(text)", "ast.parse"),
        ("sys.addaudithook(f)", "addaudithook"),
        ("sys.settrace(f)", "settrace"),
        ("gc.get_objects()", "get_objects"),
        ("open('/ws/out/0.reach')", "/ws/"),
        ("import __main__", "__main__"),
        ("sys.modules['__main__'].write = 1", "__main__"),
        ("getattr(f, '__code__')", "__code__"),
    ],
)
def test_a_look_behind_is_told_with_its_place(tmp_path: Path, line: str, what: str):
    flag, *_ = told(tmp_path, f"x = 1\n{line}\n")
    assert (flag.kind, flag.where) == ("test source", "test/test_it.py:2")
    assert what in flag.what


@pytest.mark.parametrize(
    "line",
    [
        "if __name__ == '__main__': pytest.main()",
        "dis = 1.0; parse(dis)",
        "runpy.run_module('ros2_robot_controller.robot_controller', run_name='__main__')",
        "PATH = '/home/me/ws/src'",
        "ast = yaml.parse(1)",
        "MASK = 0x" + "f" * 5000,
    ],
)
def test_what_honest_tests_say_is_not(tmp_path: Path, line: str):
    assert told(tmp_path, f"{line}\n") == []


def test_the_references_tests_are_honest():
    assert mentions(REFERENCE) == []
