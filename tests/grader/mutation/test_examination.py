"""Unreliable, interdependent and cheating tests are told apart. The runs themselves are made up."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.course import COURSE
from submissions import toy

from grader.evidence import Mutation
from grader.mutation import jobs
from grader.mutation.source import mutate
from grader.student_tests.module_results import ModuleReach
from grader.student_tests.warm_worker import WorkerPool

NARROW, WIDE = "test/test_it.py::test_narrow", "test/test_it.py::test_wide"
MUTANT, EQUIVALENT, ORIGINAL = "mutant", "equivalent mutant", "original"

Answer = Callable[[str, tuple[str, ...], int], str]
"""From what was run (MUTANT, ...), the tests, and how often it was run before, to the test that failed, or ""."""


@pytest.fixture
def play(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., Mutation]:
    made = toy.make(tmp_path, {})
    lines = {number: frozenset({NARROW, WIDE}) for number in range(1, 60)} | {60: frozenset({WIDE})}
    reach = ModuleReach("test/test_it.py", {WIDE: 0.1, NARROW: 0.1}, dict.fromkeys(
        ("ros2_robot_controller/robot_controller.py", "ros2_robot_controller/sensor_processor.py"), lines
    ))  # fmt: skip

    no_workers = WorkerPool(lambda _number, _domain: None, tmp_path, 1)  # type: ignore[arg-type,return-value]

    def play(answer: Answer, *, seconds: float = 1.0, count: int = 30, budget: float = 1000.0) -> Mutation:
        asked: Counter[object] = Counter()

        def made_up(_worker: object, _package: object, job: jobs.Job) -> jobs.JobResult:
            kind = ORIGINAL if job.change is None else EQUIVALENT if job.examines else MUTANT
            tests = tuple(job.tests)
            by = answer(kind, tests, asked[job.change]) if tests else ""
            asked[job.change] += 1
            return jobs.JobResult(
                job, by, "test/test_it.py" if by else "", False, len(tests), seconds, (by,) if by else ()
            )

        monkeypatch.setattr(jobs, "run_job", made_up)
        return mutate(made.package, made.install, [reach], COURSE, count=count, seconds=budget, workers=no_workers)

    return play


def outcomes(mutation: Mutation) -> Counter[str]:
    return Counter(mutant.outcome for mutant in mutation.mutants)


def test_tests_that_notice_mutants_and_pass_equivalent_ones_are_believed(play):
    mutation = play(lambda kind, tests, _: tests[0] if kind == MUTANT else "")
    assert outcomes(mutation) == {"noticed": 30}
    assert {mutant.by for mutant in mutation.mutants} == {NARROW}
    assert 6 <= len(mutation.equivalent_mutants) <= 10
    assert (mutation.convicted, mutation.set_aside, mutation.note) == ([], [], "")


def test_a_test_that_fails_on_every_equivalent_mutant_is_convicted_and_the_rest_is_not_tried(play):
    mutation = play(lambda kind, tests, _: tests[0] if kind != ORIGINAL else "")
    assert mutation.convicted == [NARROW]
    assert outcomes(mutation) == {"noticed": 20, "not tried": 10}, "tests are examined in the round after"
    assert len([each for each in mutation.equivalent_mutants if each.failed == [NARROW]]) == 2


@pytest.mark.parametrize(("missed", "ends"), [(0, True), (1, True), (2, False)])
def test_a_suite_that_misses_hardly_one_of_thirty_is_asked_for_no_more(missed: int, ends: bool, play):
    left = [missed]

    def answer(kind: str, tests: tuple[str, ...], _before: int) -> str:
        if kind == MUTANT and left[0]:
            left[0] -= 1
            return ""
        return tests[0] if kind == MUTANT else ""

    mutation = play(answer, count=50)
    assert (len(mutation.mutants) == 30) == ends
    assert outcomes(mutation)["unnoticed"] == missed
    assert mutation.note == ""


def test_a_test_that_fails_once_on_an_equivalent_mutant_is_set_aside_and_others_notice_its_mutants(play):
    """It passes when the same one is tried again, so it is unreliable, not a cheat."""

    def answer(kind: str, tests: tuple[str, ...], before: int) -> str:
        if kind == MUTANT:
            return tests[0]
        return NARROW if kind == EQUIVALENT and NARROW in tests and before == 0 else ""

    mutation = play(answer)
    assert mutation.set_aside == [NARROW]
    assert mutation.convicted == []
    assert {mutant.by for mutant in mutation.mutants} == {WIDE}


def test_one_odd_equivalent_mutant_convicts_no_test(play):
    odd: set[str] = set()

    def answer(kind: str, tests: tuple[str, ...], before: int) -> str:
        if kind == MUTANT:
            return tests[0]
        if kind == EQUIVALENT and tests[0] == NARROW and (not odd or before):
            odd.add("once")
            return NARROW
        return ""

    mutation = play(answer)
    assert mutation.convicted == []
    assert mutation.set_aside == [NARROW]


def test_tests_that_cannot_run_alone_run_together(play):
    """The narrow test, put first, fails on the original too: it needs what the wide one leaves behind."""

    def answer(kind: str, tests: tuple[str, ...], _before: int) -> str:
        if tests[0] == NARROW:
            return NARROW
        return WIDE if kind == MUTANT else ""

    mutation = play(answer)
    assert (mutation.convicted, mutation.set_aside) == ([], [])
    assert outcomes(mutation) == {"noticed": 30}
    assert {mutant.by for mutant in mutation.mutants} == {WIDE}


def test_tests_that_fail_on_the_original_notice_nothing(play):
    mutation = play(lambda _kind, tests, _: tests[0])
    assert set(mutation.set_aside) == {NARROW, WIDE}
    assert outcomes(mutation)["noticed"] == 0


def test_a_budget_cuts_whole_rounds(play):
    """30 s of work for 10 mutants do not fit three times into 45 s."""
    mutation = play(lambda *_: "", seconds=1.5, budget=45.0)
    assert outcomes(mutation) == {"unnoticed": 30}
    mutation = play(lambda *_: "", seconds=1.6, budget=45.0)
    assert outcomes(mutation) == {"unnoticed": 20, "not tried": 10}
    assert mutation.note == "10 of 30 mutants were not tried: the budget of 45 s was used up"


def test_unnoticed_mutants_need_no_equivalent_ones(play):
    mutation = play(lambda *_: "")
    assert outcomes(mutation) == {"unnoticed": 30}
    assert mutation.equivalent_mutants == []
    assert mutation.mutants[0].tried == [NARROW, WIDE]
