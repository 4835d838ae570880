"""F14: the four functions in utils/conversions.py."""

import math
from typing import Any

from grader.checks.judge import Judge, Unjudged
from grader.evidence import FunctionAnswer

NEEDS = ("functions",)
_NEAR = 1e-6


def test_conversions_are_right_at_their_edges(judge: Judge) -> None:
    """The four functions in `utils/conversions.py` are right at their edges."""
    judge.require_build()
    answers = judge.evidence.functions
    if not answers:
        raise Unjudged("the conversions were not called")
    problems = {answer.problem for answer in answers}
    if len(problems) == 1 and (problem := problems.pop()):  # before any function could be called
        judge.expect(
            False,
            f"utils/conversions.py cannot be imported: {problem}",
            f"is the file there, does {judge.installer} install it, and are its own imports right?",
        )
    wrong = {}
    for answer in answers:
        if answer.function not in wrong and not _is_right(answer):
            wrong[answer.function] = _case(answer)
    if wrong:
        share = 1 - len(wrong) / len(judge.course.function_names)
        judge.share(share, "; ".join(wrong.values()), "call the function with 0, pi, -pi and a full turn more")


def _is_right(answer: FunctionAnswer) -> bool:
    if answer.problem:
        return False
    wanted = _wanted(answer)
    if answer.function == "clamp":
        return _close(answer.answer, wanted)
    if answer.function == "quaternion_from_yaw":
        return _close(answer.answer, wanted) or _close([-value for value in answer.answer], wanted)
    return _is_angle(answer.answer, wanted[0])


def _wanted(answer: FunctionAnswer) -> list[float]:
    """Return the right answer; an angle in (-pi, pi]."""
    if answer.function == "clamp":
        value, low, high = answer.arguments
        return [min(max(value, low), high)]
    if answer.function == "quaternion_from_yaw":
        yaw = answer.arguments[0]
        return [0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)]
    angle = answer.arguments[0] if answer.function == "normalize_angle" else _yaw(answer.arguments[0])
    wrapped = math.remainder(angle, math.tau)
    return [math.pi if wrapped <= -math.pi + _NEAR else wrapped]


def _is_angle(found: list[float], wanted: float) -> bool:
    """Return whether `found` is the angle `wanted`, in (-pi, pi]. At half a turn rounding decides the sign."""
    if len(found) != 1 or not -math.pi < found[0] <= math.pi + _NEAR:
        # -pi itself is outside; a value that is not exactly half a turn may come near it from above.
        return False
    return abs(math.remainder(found[0] - wanted, math.tau)) <= _NEAR


def _yaw(quaternion: list[float]) -> float:
    x, y, z, w = quaternion
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _close(found: list[float], wanted: list[float]) -> bool:
    return len(found) == len(wanted) and all(abs(a - b) <= _NEAR for a, b in zip(found, wanted, strict=True))


def _case(answer: FunctionAnswer) -> str:
    """Return the case, the value wanted and the value returned."""
    arguments = ", ".join(_show(argument) for argument in answer.arguments)
    result = answer.problem or _show(answer.answer)
    return f"{answer.function}({arguments}) gave {result}; right is {_show(_wanted(answer))}"


def _show(value: Any) -> str:
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    if isinstance(value, list):
        return "(" + ", ".join(f"{item:.3f}" for item in value) + ")"
    return f"{value:.4f}"
