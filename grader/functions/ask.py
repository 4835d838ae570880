"""Ask the package's conversions for their answers, at their edges and at places that the seed chooses."""

from __future__ import annotations

import json
import math
import random
import tempfile
from pathlib import Path
from typing import Any

from grader import build, sandbox, toolchain
from grader.evidence import FunctionAnswer

_PROBE = Path(__file__).parent / "probe.py"
_CAP = 1_000_000


def ask_conversions(install: Path, seed: int) -> list[FunctionAnswer]:
    """Return what the four functions of utils/conversions.py answer, each with its arguments.

    A quaternion is a list [x, y, z, w], as an argument and as an answer. What does not come back in the form it was
    asked for counts as no answer.
    """
    asked = questions(seed)
    with tempfile.TemporaryDirectory(prefix="conversions-") as scratch:
        room = Path(scratch)
        (room / "out").mkdir()
        (room / "questions.json").write_text(json.dumps(asked))
        wall = sandbox.Wall(
            read_only={
                install: str(build.INSTALL), _PROBE: "/ws/probe.py", room / "questions.json": "/ws/questions.json",
            },
            writable={room / "out": "/ws/out"},
            environment=toolchain.environment(build.INSTALL, home=sandbox.HOME),
        )  # fmt: skip
        command = ["python3", "/ws/probe.py", "/ws/questions.json", "/ws/out/answers.json"]
        result = sandbox.run(command, wall, sandbox.Limits(wall_seconds=30.0))
        answers = _read(room / "out" / "answers.json")
    last = result.output.strip().splitlines()[-1:] or [f"ended with status {result.exit_code}"]
    return [_answer(q, answers[i] if i < len(answers) else {"problem": last[0][:200]}) for i, q in enumerate(asked)]


def questions(seed: int) -> list[dict[str, Any]]:
    """Return what is asked: edges first, then places of the seed's choice. Angles in radians."""
    chance = random.Random(f"{seed}:conversions")
    pi = math.pi
    angles = [0.0, pi, -pi, 3 * pi, -3 * pi, 2 * pi, pi / 2, -pi / 2, pi + 0.1, -pi - 0.1, 7.0, -7.0, 100.0]
    angles += [round(chance.uniform(-50, 50), 3) for _ in range(8)]
    yaws = [0.0, pi, pi / 2, -pi / 2, 3.1, -3.1] + [round(chance.uniform(-3.1, 3.1), 3) for _ in range(6)]
    halves = [[0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)] for yaw in yaws]
    # The same turn has two quaternions.
    halves += [[-value for value in half] for half in halves]
    limits = [(0.5, 0.0, 1.0), (-2.0, 0.0, 1.0), (7.0, 0.0, 1.0), (0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (-0.5, -1.0, 1.0)]
    limits += [(-3.0, -1.0, -0.5), (0.0, -1.0, -0.5), (5.0, 2.0, 2.0)]
    limits += [(round(chance.uniform(-9, 9), 2), -3.5, 4.25) for _ in range(4)]
    return [
        *({"function": "normalize_angle", "arguments": [angle]} for angle in angles),
        *({"function": "yaw_from_quaternion", "arguments": [half]} for half in halves),
        *({"function": "quaternion_from_yaw", "arguments": [yaw]} for yaw in [*yaws, 2 * pi, -4.0]),
        *({"function": "clamp", "arguments": list(triple)} for triple in limits),
    ]


def _answer(question: dict[str, Any], found: Any) -> FunctionAnswer:
    value = found.get("answer") if isinstance(found, dict) else None
    problem = str(found.get("problem", ""))[:200] if isinstance(found, dict) else ""
    numbers: list[Any] = value if isinstance(value, list) else [value]
    if problem or not all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers) or len(numbers) > 4:
        return FunctionAnswer(question["function"], question["arguments"], [], problem or f"returned {value!r}"[:200])
    return FunctionAnswer(question["function"], question["arguments"], [float(n) for n in numbers])


def _read(path: Path) -> list[Any]:
    try:
        if path.is_symlink() or path.stat().st_size > _CAP:
            return []
        found = json.loads(path.read_text())
    except (OSError, ValueError, RecursionError):
        return []
    return found if isinstance(found, list) else []
