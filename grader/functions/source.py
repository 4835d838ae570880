"""The functions of the contract as a source of evidence: called with the course's cases and what the seed chooses."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

from grader import building, sandbox
from grader.course import Course
from grader.course.reader import modules
from grader.evidence import FunctionAnswer
from grader.host import ros_env, tempdir
from grader.processes.jobs import Job, Where
from grader.sandbox import untrusted
from grader.source import Asked, Collected, Source, Subject

_WORKER = Path(__file__).parent / "worker.py"


def call_functions(install: Path, seed: int, course: Course, ros_name: str = "") -> list[FunctionAnswer]:
    """Return what the functions of the contract answer, each with its arguments.

    The cases are what `questions(rng)` in the course's folder functions returns.

    A quaternion is a list [x, y, z, w], as an argument and as an answer. An answer of any other form than a number or
    a quaternion counts as none. `ros_name` is the name under which the package was installed.
    """
    asked = questions(course, seed)
    with tempdir.folder("functions") as folder:
        questions_file, out = folder / "questions.json", folder / "out"
        out.mkdir()
        questions_file.write_text(json.dumps(asked))
        inside, program = "/ws/questions.json", "/ws/functions_worker.py"
        box = sandbox.Sandbox(
            read_only={install: str(building.INSTALL), _WORKER: program, questions_file: inside},
            writable={out: "/ws/out"},
            environment=ros_env.environment(building.INSTALL, home=sandbox.HOME),
        )
        command = ["python3", program, _module(install, course, ros_name), inside, "/ws/out/answers.json"]
        result = sandbox.run(command, box, sandbox.Limits(wall_seconds=30.0))
        answers = untrusted.read_json(out / "answers.json")
    if not isinstance(answers, list):
        answers = []
    last_line = (result.output.strip().splitlines() or [f"ended with status {result.exit_code}"])[-1]
    missing = [{"problem": last_line[:200]}] * (len(asked) - len(answers))
    return [_answer(question, found) for question, found in zip(asked, [*answers, *missing], strict=False)]


def _module(install: Path, course: Course, ros_name: str) -> str:
    """Return the name of the functions' module; a package under another name may have kept its folder's."""
    assert course.functions is not None
    inside = course.functions.module.partition("/")[2]
    site = install / ros_env.SITE_IN_PREFIX
    found = [name for name in (course.package, ros_name) if name and (site / name / inside).is_file()]
    return f"{found[0] if found else course.package}.{inside.removesuffix('.py').replace('/', '.')}"


def questions(course: Course, seed: int) -> list[dict[str, Any]]:
    """Return the calls to make, as function and arguments; the seed decides those that are random."""
    (cases,) = modules(course.path("functions"))
    asked: list[dict[str, Any]] = cases.questions(random.Random(f"{seed}:functions"))
    return asked


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


class FunctionCalls(Source):
    """Calls the functions of the contract with the course's cases."""

    name = "functions"

    def ask(self, subject: Subject) -> Asked:
        """Return the one job of calling them all."""
        settings = subject.settings
        job = Job(
            self.name, Where.SANDBOX, list[FunctionAnswer],
            lambda: call_functions(subject.install, settings.seed, settings.course, subject.ros_name),
            decided_by=(subject.seen_by_nodes,),
            lasting=lambda answers: not any(answer.problem for answer in answers),
            serves=self.serves(settings),
        )  # fmt: skip
        return Asked([job], lambda results: Collected({self.name: results[self.name]}))
