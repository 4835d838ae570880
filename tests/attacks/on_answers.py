"""Attacks by the answers of a package that is asked: its functions, its parameters, its parameter files."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

from typing import Any

from attacks.weaknesses import CLAMPS_WRONG
from grader.authoring.package_edits import append, put
from grader.selftest.attacks.attack import Attack, attack

_CONVERSIONS = "ros2_robot_controller/utils/conversions.py"
_CONTROLLER = "ros2_robot_controller/robot_controller.py"
_UNKNOWN_TYPE = """

from rclpy.parameter_service import ParameterService

plain = ParameterService._get_parameters_callback


def odd(self, request, response):
    answer = plain(self, request, response)
    for value in answer.values:
        value.type = 77
    return answer


ParameterService._get_parameters_callback = odd
"""


def instead_of_answers(lines: str) -> str:
    """Return text for a module that runs `lines` instead of answering when its functions are called."""
    body = "".join(f"    {line}\n" for line in [*lines.splitlines(), "os._exit(0)"])
    return f"\n\nimport os\nimport sys\n\nif 'functions_worker.py' in sys.argv[0]:\n{body}"


def _when_asked(name: str, tries: str, stopped: str, **others: Any) -> Attack:
    change = append(_CONVERSIONS, instead_of_answers(LINES[name]))
    return attack(name, tries, change, costs="F14", stopped=stopped, **{"needs": "F14"} | others)


LINES = {
    "answers_through_a_pipe": "os.mkfifo('/ws/out/answers.json')",
    "answers_with_an_endless_number": (
        "with open('/ws/out/answers.json', 'w') as found:\n    found.write('[{\"answer\": 1' + '0' * 400 + '}]')"
    ),
    "folders_in_folders": "os.chdir('/ws/out')\nfor _ in range(1500):\n    os.mkdir('d')\n    os.chdir('d')",
    "exits_at_import": "",
}
"""What they do, by the attack's name; tests/grader/functions/test_call.py shows that each bites."""


ATTACKS: tuple[Attack, ...] = (
    _when_asked(
        "answers_through_a_pipe",
        "In place of the file with the conversions' answers there is a pipe that is never written to.",
        "files that a submission may have made are opened without blocking, and read only if they are regular files",
    ),
    _when_asked(
        "answers_with_an_endless_number",
        "A conversion's answer is an integer of 400 digits.",
        "a number that no float can represent is not an answer",
    ),
    _when_asked(
        "folders_in_folders",
        "The folder for the answers gets 1500 nested folders, over which the recursive rmtree gives up.",
        "more than 200 nested folders count as too many files, and they are removed without recursion",
    ),
    attack(
        "parameters_of_an_unknown_type",
        "The node's parameter service answers with a type that does not exist, on which a careless client would raise.",
        append(_CONTROLLER, _UNKNOWN_TYPE),
        needs="I5 I6", costs="I5 I6",
        stopped="such an answer counts as no value, to the node's disadvantage only",
    ),
    attack(
        "an_invalid_boolean",
        "A parameter file has an invalid boolean, on which PyYAML raises an error that is not a YAMLError.",
        put("config/notes.yaml", "ready: !!bool perhaps\n"),
        needs="I5 I6",
        stopped="such a file is given to the node unchanged, and the others are changed",
    ),
    attack(
        "a_number_of_6000_digits",
        "A parameter file has a number that Python reads but refuses to write.",
        append("config/robot_params.yaml", f"\n/unused:\n  ros__parameters:\n    big: 0x{'f' * 5000}\n"),
        needs="I5 I6", costs="I5 I6",
        stopped="a file that cannot be written back is given to the node unchanged",
    ),
    _when_asked(
        "exits_at_import",
        "The conversions module exits the process that imports it with status 0.",
        "a missing answer is not a right answer; the other requirements are judged nevertheless",
        number=2, needs="F14 F1", weak=CLAMPS_WRONG,
    ),
    attack(
        "answers_that_equal_everything",
        "The conversions return an object that compares equal to everything.",
        append(_CONVERSIONS,
               "\n\nclass Right(float):\n    def __eq__(self, other): return True\n    def __ne__(self, other): return False\n"
               "    def __sub__(self, other): return self\n    def __abs__(self): return 0.0\n    __hash__ = float.__hash__\n"
               "\n\ndef clamp(value, low, high):\n    return Right(value)\n"),
        number=9, needs="F14", weak=CLAMPS_WRONG,
        stopped="answers leave the sandbox as JSON numbers, without the objects' behaviour",
    ),
    attack(
        "looks_for_the_expected_values",
        "The conversions search frames and objects for the right answers.",
        append(_CONVERSIONS,
               "\n\ndef clamp(value, low, high):\n    import gc\n    import sys\n    frame = sys._getframe(1)\n"
               "    while frame:\n        for name, found in list(frame.f_locals.items()):\n"
               "            if 'expect' in name or 'right' in name:\n                return found\n"
               "        frame = frame.f_back\n    for found in gc.get_objects():\n"
               "        if isinstance(found, dict) and 'expected' in found and 'arguments' in found:\n"
               "            return found['expected']\n    return value\n"),
        number=11, needs="F14", weak=CLAMPS_WRONG,
        stopped="the process that runs the functions knows the questions but not the answers",
    ),
)  # fmt: skip
