"""The package's conversions are called in a sandbox. Whatever it leaves is data, and the grader never hangs on it."""

from __future__ import annotations

from pathlib import Path

import pytest
from attacks.on_answers import LINES, instead_of_answers
from helpers.course import COURSE

from grader import KIT
from grader.evidence import FunctionAnswer
from grader.functions.call import call_functions
from grader.host import ros_env

pytestmark = pytest.mark.sandbox

HONEST = (KIT / "solution_pkg/ros2_robot_controller/ros2_robot_controller/utils/conversions.py").read_text()


def asked(tmp_path: Path, more: str) -> list[FunctionAnswer]:
    """Return what the reference's functions answer when `more` is added to their module."""
    tmp_path.chmod(0o755)  # pytest's folder is its user's alone, and the package is called by another one
    package = tmp_path / ros_env.SITE_IN_PREFIX / "ros2_robot_controller"
    (package / "utils").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "utils" / "__init__.py").touch()
    (package / "utils" / "conversions.py").write_text(f"{HONEST}\n{more}\n")
    return call_functions(tmp_path, 1, COURSE)


def test_the_reference_answers_every_question(tmp_path: Path):
    answers = asked(tmp_path, "")
    assert len(answers) > 40
    assert not [answer for answer in answers if answer.problem]


OTHERS = {
    "a list without end": "open('/ws/out/answers.json', 'w').write('[' * 100000)",
    "a link": "os.symlink('/etc/passwd', '/ws/out/answers.json')",
}


@pytest.mark.parametrize("lines", (LINES | OTHERS).values(), ids=LINES | OTHERS)
def test_anything_but_answers_counts_as_no_answer(tmp_path: Path, lines: str):
    answers = asked(tmp_path, instead_of_answers(lines))
    assert len(answers) > 40
    assert not [answer for answer in answers if answer.answer]
