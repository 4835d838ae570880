"""The package's conversions are called in a sandbox. Whatever it leaves is data, and the grader never hangs on it."""

from __future__ import annotations

from pathlib import Path

import pytest
from attacks import ATTACKS
from helpers.course import COURSE

from grader import KIT
from grader.evidence import FunctionAnswer
from grader.functions.source import call_functions
from grader.host import ros_env
from grader.intake.package_edits import Change, append

pytestmark = pytest.mark.sandbox

HONEST = (KIT / "solution_pkg/ros2_robot_controller/ros2_robot_controller/utils/conversions.py").read_text()


def asked(tmp_path: Path, *changes: Change) -> list[FunctionAnswer]:
    """Return what the reference's functions answer after changes of their package."""
    tmp_path.chmod(0o755)  # pytest's folder is its user's alone, and the package is called by another one
    package = tmp_path / ros_env.SITE_IN_PREFIX / "ros2_robot_controller"
    (package / "utils").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "utils" / "__init__.py").touch()
    (package / "utils" / "conversions.py").write_text(HONEST)
    for change in changes:
        change(package.parent)
    return call_functions(tmp_path, 1, COURSE)


def instead_of_answers(line: str) -> Change:
    text = f"\nimport os\nif 'functions_worker.py' in __import__('sys').argv[0]: {line}; os._exit(0)\n"
    return append("ros2_robot_controller/utils/conversions.py", text)


def test_the_reference_answers_every_question(tmp_path: Path):
    answers = asked(tmp_path)
    assert len(answers) > 40
    assert not [answer for answer in answers if answer.problem]


NAMES = ("answers_through_a_pipe", "answers_with_an_endless_number", "exits_at_import", "folders_in_folders")
INSTEAD = {each.name: each.changes[0] for each in ATTACKS if each.name in NAMES} | {
    "a_list_without_end": instead_of_answers("open('/ws/out/answers.json', 'w').write('[' * 100000)"),
    "a_link": instead_of_answers("os.symlink('/etc/passwd', '/ws/out/answers.json')"),
}


@pytest.mark.parametrize("change", INSTEAD.values(), ids=INSTEAD)
def test_anything_but_answers_counts_as_no_answer(tmp_path: Path, change: Change):
    answers = asked(tmp_path, change)
    assert len(INSTEAD) == 6
    assert len(answers) > 40
    assert not [answer for answer in answers if answer.answer]
