"""Attacks by what comes back when the package is asked: its functions, its parameters, its parameter files."""

from __future__ import annotations

from grader.selftest.attacks.attack import Attack, append, attack, put

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
    """Return an attack that does something else than to answer when the conversions are asked."""
    body = "".join(f"    {line}\n" for line in [*lines.splitlines(), "os._exit(0)"])
    probed = f"\n\nimport os\nimport sys\n\nif 'conversions_worker.py' in sys.argv[0]:\n{body}"
    return attack(name, tries, append(_CONVERSIONS, probed), needs="F14", costs="F14", stopped=stopped)


ATTACKS: tuple[Attack, ...] = (
    _when_asked(
        "answers_through_a_pipe",
        "Where the conversions' answers should lie there is a pipe that nobody writes to.",
        "os.mkfifo('/ws/out/answers.json')",
        "what a submission may have made is opened without waiting, and read only if it is a plain file",
    ),
    _when_asked(
        "answers_with_an_endless_number",
        "A conversion's answer is an integer of 400 digits.",
        "with open('/ws/out/answers.json', 'w') as found:\n    found.write('[{\"answer\": 1' + '0' * 400 + '}]')",
        "a number that no float can hold is no answer",
    ),
    _when_asked(
        "folders_in_folders",
        "The folder for the answers gets 1500 folders in one another: rmtree goes down by recursion, and gives up.",
        "os.chdir('/ws/out')\nfor _ in range(1500):\n    os.mkdir('d')\n    os.chdir('d')",
        "more than 200 folders in one another are too many files, and they are removed without recursion",
    ),
    attack(
        "parameters_of_an_unknown_type",
        "The node's parameter service answers with a type that there is not: our client would raise.",
        append(_CONTROLLER, _UNKNOWN_TYPE),
        needs="I5 I6", costs="I5 I6",
        stopped="such an answer has no value, and that is the node's affair",
    ),
    attack(
        "a_value_that_is_not_what_it_says",
        "A parameter file holds a truth value that is none, at which PyYAML raises an error that is not its own.",
        put("config/notes.yaml", "ready: !!bool perhaps\n"),
        needs="I5 I6",
        stopped="such a file is handed to the node as it is, and the others are changed",
    ),
    attack(
        "a_number_of_6000_digits",
        "A parameter file holds a number that Python reads and refuses to write.",
        append("config/robot_params.yaml", f"\n/unused:\n  ros__parameters:\n    big: 0x{'f' * 5000}\n"),
        needs="I5 I6", costs="I5 I6",
        stopped="a file that cannot be written back is handed to the node as it is",
    ),
)  # fmt: skip
