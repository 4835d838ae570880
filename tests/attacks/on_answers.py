"""Attacks by the answers of a package that is asked: its functions, its parameters, its parameter files."""

from __future__ import annotations

from grader.selftest.attacks.attack import Attack, attack
from grader.selftest.package_edits import append, put

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


def _when_asked(name: str, tries: str, lines: str, stopped: str) -> Attack:
    """Return an attack that runs `lines` instead of answering when the conversions are called."""
    body = "".join(f"    {line}\n" for line in [*lines.splitlines(), "os._exit(0)"])
    probed = f"\n\nimport os\nimport sys\n\nif 'conversions_worker.py' in sys.argv[0]:\n{body}"
    return attack(name, tries, append(_CONVERSIONS, probed), needs="F14", costs="F14", stopped=stopped)


ATTACKS: tuple[Attack, ...] = (
    _when_asked(
        "answers_through_a_pipe",
        "In place of the file with the conversions' answers there is a pipe that is never written to.",
        "os.mkfifo('/ws/out/answers.json')",
        "files that a submission may have made are opened without blocking, and read only if they are regular files",
    ),
    _when_asked(
        "answers_with_an_endless_number",
        "A conversion's answer is an integer of 400 digits.",
        "with open('/ws/out/answers.json', 'w') as found:\n    found.write('[{\"answer\": 1' + '0' * 400 + '}]')",
        "a number that no float can represent is not an answer",
    ),
    _when_asked(
        "folders_in_folders",
        "The folder for the answers gets 1500 nested folders, over which the recursive rmtree gives up.",
        "os.chdir('/ws/out')\nfor _ in range(1500):\n    os.mkdir('d')\n    os.chdir('d')",
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
)  # fmt: skip
