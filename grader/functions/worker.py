"""Runs in the sandbox: call functions of a module with the arguments of a file and write down the answers.

It knows no right answers, and it is mounted alone: nothing else of the kit is visible.
"""

import importlib
import json
import sys
from pathlib import Path

from geometry_msgs.msg import Quaternion


def plain(value: object) -> object:
    """Return a number or a quaternion as JSON can hold it; anything else as the name of its type."""
    if isinstance(value, Quaternion):
        return [value.x, value.y, value.z, value.w]
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return type(value).__name__


def answer(module: object, question: dict[str, object]) -> dict[str, object]:
    """Return the question with its answer, or with what went wrong."""
    arguments = [
        Quaternion(x=a[0], y=a[1], z=a[2], w=a[3]) if isinstance(a, list) else a
        for a in question["arguments"]  # type: ignore[attr-defined]
    ]
    try:
        return {**question, "answer": plain(getattr(module, str(question["function"]))(*arguments))}
    except Exception as error:
        return {**question, "problem": f"{type(error).__name__}: {error}"[:200]}


def main() -> None:
    """Ask the module argv[1] the questions in the file argv[2] and write the answers to argv[3]."""
    name, questions, answers = sys.argv[1:]
    asked = json.loads(Path(questions).read_text())
    try:
        module = importlib.import_module(name)
        found = [answer(module, question) for question in asked]
    except Exception as error:
        found = [{**question, "problem": f"{type(error).__name__}: {error}"[:200]} for question in asked]
    Path(answers).write_text(json.dumps(found))


if __name__ == "__main__":
    main()
