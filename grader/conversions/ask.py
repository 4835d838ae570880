"""Call the package's conversions with edge cases and with arguments that the seed chooses."""

from __future__ import annotations

import json
import math
import random
from pathlib import Path
from typing import Any

from grader import building, sandbox
from grader.contract.spec import PACKAGE
from grader.evidence import FunctionAnswer
from grader.host import ros_env, tempdir
from grader.sandbox import untrusted

_WORKER = Path(__file__).parent / "worker.py"


def ask_conversions(install: Path, seed: int, ros_name: str = PACKAGE) -> list[FunctionAnswer]:
    """Return what the four functions of utils/conversions.py answer, each with its arguments.

    A quaternion is a list [x, y, z, w], as an argument and as an answer. An answer of any other form than a number or
    a quaternion counts as none. `ros_name` is the package's name.
    """
    asked = questions(seed)
    with tempdir.folder("conversions") as folder:
        questions_file, out = folder / "questions.json", folder / "out"
        out.mkdir()
        questions_file.write_text(json.dumps(asked))
        inside, program = "/ws/questions.json", "/ws/conversions_worker.py"
        box = sandbox.Sandbox(
            read_only={install: str(building.INSTALL), _WORKER: program, questions_file: inside},
            writable={out: "/ws/out"},
            environment=ros_env.environment(building.INSTALL, home=sandbox.HOME),
        )
        command = ["python3", program, _module(install, ros_name), inside, "/ws/out/answers.json"]
        result = sandbox.run(command, box, sandbox.Limits(wall_seconds=30.0))
        answers = untrusted.read_json(out / "answers.json")
    if not isinstance(answers, list):
        answers = []
    last_line = (result.output.strip().splitlines() or [f"ended with status {result.exit_code}"])[-1]
    missing = [{"problem": last_line[:200]}] * (len(asked) - len(answers))
    return [_answer(question, found) for question, found in zip(asked, [*answers, *missing], strict=False)]


def _module(install: Path, ros_name: str) -> str:
    """Return the name of the module with the conversions; a package under another name may have kept its folder's."""
    site = install / ros_env.SITE_IN_PREFIX
    found = [name for name in (PACKAGE, ros_name) if (site / name / "utils" / "conversions.py").is_file()]
    return f"{found[0] if found else PACKAGE}.utils.conversions"


def questions(seed: int) -> list[dict[str, Any]]:
    """Return the calls to make, as function and arguments: edge cases first, then random ones. Angles in radians."""
    rng = random.Random(f"{seed}:conversions")
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
    limits += [(-3.0, -1.0, -0.5), (0.0, -1.0, -0.5), (5.0, 2.0, 2.0)]
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


def _answer(question: dict[str, Any], found: Any) -> FunctionAnswer:
    """Return an answer as a fact; `found` is whatever the sandbox left."""
    value = found.get("answer") if isinstance(found, dict) else None
    problem = str(found.get("problem", ""))[:200] if isinstance(found, dict) else ""
    numbers: list[Any] = value if isinstance(value, list) else [value]
    try:
        if any(not isinstance(n, int | float) or isinstance(n, bool) for n in numbers) or len(numbers) > 4:
            problem = problem or f"returned {value!r}"[:200]
        answer = [] if problem else [float(n) for n in numbers]
    except (OverflowError, ValueError, RecursionError):  # a number, or a list, that is too large
        answer, problem = [], "returned a number that is too large"
    return FunctionAnswer(question["function"], question["arguments"], answer, problem)
