"""The functions that a course names, at their edges. Its folder functions says what is right: `is_right`, `right`."""

from typing import Any

from grader.checks.judge import Failed, Judge, Unjudged
from grader.course.reader import modules
from grader.evidence import FunctionAnswer
from grader.words import say

NEEDS = ("functions",)


def test_functions_are_right_at_their_edges(judge: Judge) -> None:
    """The functions that the contract names are right at their edges."""
    judge.require_build()
    answers, course = judge.evidence.functions, judge.course
    if not answers or course.functions is None:
        raise Unjudged("the functions were not called")
    problems = {answer.problem for answer in answers}
    if len(problems) == 1 and (problem := problems.pop()):  # before any function could be called
        seen = say("{module} cannot be imported: {problem}", module=course.functions.module, problem=problem)
        try_ = say("is the file there, does {judge.installer} install it, and are its own imports right?", judge=judge)
        raise Failed(seen, try_)
    (cases,) = modules(course.path("functions"))
    wrong: dict[str, str] = {}
    for answer in answers:
        if answer.function not in wrong and (answer.problem or not cases.is_right(answer)):
            wrong[answer.function] = _case(answer, cases.right(answer))
    if wrong:
        share = 1 - len(wrong) / len(course.functions.names)
        judge.share(share, "; ".join(wrong.values()), cases.TRY)


def _case(answer: FunctionAnswer, right: list[float]) -> str:
    """Return the case, the value wanted and the value returned."""
    call = f"{answer.function}({', '.join(map(_show, answer.arguments))})"
    result = answer.problem or _show(answer.answer)
    return say("{call} gave {result}; right is {right}", call=call, result=result, right=_show(right))


def _show(value: Any) -> str:
    if not isinstance(value, list) or len(value) == 1:
        return f"{value[0] if isinstance(value, list) else value:.4f}"
    return "(" + ", ".join(f"{item:.3f}" for item in value) + ")"
