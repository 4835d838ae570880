"""The list of a course's trials: its functions that are decorated with `@trial`, and the stock ones."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any

from grader.course import Course
from grader.course.reader import held_back_names, modules
from grader.errors import GraderError
from grader.trials import stock
from grader.trials.plan import TrialPlan
from grader.yaml_reader import unknown

if TYPE_CHECKING:
    from grader.trials.stage import Stage

Script = Callable[["Stage"], None]

_PLAN = "trial_plan"
_OPTIONS = tuple(field.name for field in fields(TrialPlan) if field.name not in ("name", "sentence", "script", "kind"))


def trial(*, serves: Iterable[str] = (), **options: Any) -> Callable[[Script], Script]:
    """Make the decorated script a trial, under its own name; its docstring is the trial's sentence.

    Args:
        serves: the requirements that the trial is evidence for; see TrialPlan.
        options: other fields of TrialPlan. Without `node` it is about the contract's first node.
    """
    for name in options:
        if name not in _OPTIONS:
            raise TypeError(unknown(name, _OPTIONS, "an option of @trial"))

    def add(script: Script) -> Script:
        sentence = (script.__doc__ or "").strip().partition("\n")[0]
        setattr(script, _PLAN, TrialPlan(script.__name__, sentence, script, serves=tuple(serves), **options))
        return script

    return add


@cache
def trials(course: Course) -> dict[str, TrialPlan]:
    """Return every trial of a course by its name, after importing its modules.

    Raises:
        GraderError: two have the same name, or one is about a node that is not in the contract.
    """
    found: dict[str, TrialPlan] = {}
    problems = []
    for module in (*modules(course.folder / "trials"), *modules(course.held_back / "trials")):
        own = (item for item in vars(module).values() if getattr(item, "__module__", "") == module.__name__)
        for plan in (getattr(item, _PLAN) for item in own if hasattr(item, _PLAN)):
            node = plan.node or next(iter(course.nodes))
            if plan.name in found or node not in course.nodes:
                wrong = "another trial has this name" if plan.name in found else f"the contract has no node {node}"
                problems.append(f"{module.__file__}: the trial {plan.name}: {wrong}. Rename it.")
            found[plan.name] = replace(plan, node=node)
    for plan in () if problems else stock.plans(course):
        found[plan.name] = replace(found[plan.name], kind=plan.kind) if plan.name in found else plan
    for plan in list(found.values()):
        if plan.follows and plan.follows not in found:  # its file may be gone
            found[plan.name] = replace(plan, follows="")
        elif plan.follows and (wrong := _cannot_follow(plan, found, held_back_names(course))):
            problems.append(f"the trial {plan.name} cannot follow {plan.follows}: {wrong}.")
    if problems:
        raise GraderError("\n".join(problems))
    noted = {plan.node for plan in found.values() if plan.notes_functions}
    for plan in list(found.values()):
        if plan.kind == stock.idle.__name__ and plan.node not in noted:
            found[plan.name] = replace(plan, notes_functions=True)
    return found


def _cannot_follow(plan: TrialPlan, every: Mapping[str, TrialPlan], secret: Collection[str]) -> str:
    """Return why a trial cannot go on with the node of the one that it follows, "" if it can."""
    before = every[plan.follows]
    if plan.launch or plan.notes_functions or before.start != plan.start:
        return "the two start their nodes in different ways"
    if before.name in secret and plan.name not in secret:
        return "a node could tell in it what it saw of a trial that is held back"
    names = [plan.name]
    while (name := every[names[-1]].follows) in every:
        if name in names:
            return "it comes before itself"
        names.append(name)
    return ""
