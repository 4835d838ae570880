"""The list of trials: every function in grader/trials/scripts that is decorated with `@trial`."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from grader.trials import scripts
from grader.trials.plan import TrialPlan

if TYPE_CHECKING:
    from grader.trials.stage import Stage

Script = Callable[["Stage"], None]

_PLANS: dict[str, TrialPlan] = {}


def trial(*, serves: Iterable[str], **options: Any) -> Callable[[Script], Script]:
    """Add the decorated script to the list of trials, under its own name; its docstring is the trial's sentence.

    Args:
        serves: the requirements that the trial is evidence for.
        options: other fields of TrialPlan.
    """

    def add(script: Script) -> Script:
        name = script.__name__
        if name in _PLANS:
            raise ValueError(f"two trials are called {name}")
        sentence = (script.__doc__ or "").strip().partition("\n")[0]
        _PLANS[name] = TrialPlan(name, sentence, script, serves=tuple(serves), **options)
        return script

    return add


def trials() -> dict[str, TrialPlan]:
    """Return every trial by its name, after importing each module of grader/trials/scripts."""
    for module in pkgutil.iter_modules(scripts.__path__, f"{scripts.__name__}."):
        importlib.import_module(module.name)
    return dict(_PLANS)


def serving(requirements: Iterable[str]) -> dict[str, TrialPlan]:
    """Return the trials that serve at least one of the requirements."""
    wanted = set(requirements)
    return {name: plan for name, plan in trials().items() if wanted & set(plan.serves)}
