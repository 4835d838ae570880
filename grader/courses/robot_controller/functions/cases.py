"""The cases with which the functions of utils/conversions.py are called, and what is right."""

from __future__ import annotations

import math
import random
from typing import Any

from grader.evidence import FunctionAnswer

TRY = "call the function with 0, pi, -pi and a full turn more"
"""What to try where an answer is wrong."""
_NEAR = 1e-6


def questions(rng: random.Random) -> list[dict[str, Any]]:
    """Return the calls to make, as function and arguments: edge cases first, then random ones. Angles in radians."""
    pi = math.pi
    angles = [0.0, pi, -pi, 3 * pi, -3 * pi, 2 * pi, pi / 2, -pi / 2, pi + 0.1, -pi - 0.1, 7.0, -7.0, 100.0]
    angles += [round(rng.uniform(-50, 50), 3) for _ in range(8)]
    yaws = [0.0, pi, pi / 2, -pi / 2, 3.1, -3.1] + [round(rng.uniform(-3.1, 3.1), 3) for _ in range(6)]
    quaternions = [[0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)] for yaw in yaws]
    # q and -q are the same rotation.
    quaternions += [[-value for value in quaternion] for quaternion in quaternions]
    # A robot on a ramp has a yaw as well.
    quaternions += [
        _quaternion(0.3, 0.0, 2.5),
        _quaternion(0.0, -0.4, -1.0),
        _quaternion(-0.25, 0.35, round(rng.uniform(-3.0, 3.0), 3)),
    ]
    limits = [(0.5, 0.0, 1.0), (-2.0, 0.0, 1.0), (7.0, 0.0, 1.0), (0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (-0.5, -1.0, 1.0)]
    limits += [(-3.0, -1.0, -0.5), (0.0, -1.0, -0.5), (5.0, 2.0, 2.0), (-9.0, -3.5, 4.25), (9.0, -3.5, 4.25)]
    limits += [(round(rng.uniform(-9, 9), 2), -3.5, 4.25) for _ in range(4)]
    return [
        *({"function": "normalize_angle", "arguments": [angle]} for angle in angles),
        *({"function": "yaw_from_quaternion", "arguments": [quaternion]} for quaternion in quaternions),
        *({"function": "quaternion_from_yaw", "arguments": [yaw]} for yaw in [*yaws, 2 * pi, -4.0]),
        *({"function": "clamp", "arguments": list(triple)} for triple in limits),
    ]


def _quaternion(roll: float, pitch: float, yaw: float) -> list[float]:
    """Return the quaternion [x, y, z, w] of a roll, then a pitch, then a yaw, about the fixed axes x, y and z."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(angle / 2), math.cos(angle / 2)) for angle in (roll, pitch, yaw))
    return [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]


def is_right(answer: FunctionAnswer) -> bool:
    """Return whether an answer is right."""
    wanted = right(answer)
    if answer.function == "clamp":
        return _close(answer.answer, wanted)
    if answer.function == "quaternion_from_yaw":
        return _close(answer.answer, wanted) or _close([-value for value in answer.answer], wanted)
    # At half a turn rounding decides the sign; -pi itself is outside, and what is not exactly half a turn may be near.
    angle = answer.answer[0] if len(answer.answer) == 1 else math.inf
    return -math.pi < angle <= math.pi + _NEAR and abs(math.remainder(angle - wanted[0], math.tau)) <= _NEAR


def right(answer: FunctionAnswer) -> list[float]:
    """Return the right answer; an angle in (-pi, pi]."""
    if answer.function == "clamp":
        value, low, high = answer.arguments
        return [min(max(value, low), high)]
    if answer.function == "quaternion_from_yaw":
        yaw = answer.arguments[0]
        return [0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)]
    angle = answer.arguments[0]
    if answer.function == "yaw_from_quaternion":
        x, y, z, w = angle
        angle = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    wrapped = math.remainder(angle, math.tau)
    return [math.pi if wrapped <= -math.pi + _NEAR else wrapped]


def _close(found: list[float], wanted: list[float]) -> bool:
    return len(found) == len(wanted) and all(abs(a - b) <= _NEAR for a, b in zip(found, wanted, strict=True))
