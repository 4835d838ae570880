"""The list of trials. A trial is a function over a Stage, with the node, the world and the requirements it serves."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from grader.trials.stage import Stage

Script = Callable[["Stage"], None]

SCRIPTS = "grader.trials.scripts"
OWN_LAUNCH = "remapping_launch.py"
"""A launch file of ours: grader/trials/launch/remapping_launch.py."""


@dataclass(frozen=True)
class TrialPlan:
    """One trial: a script, the node it is done to, the world it happens in, and what it is evidence for.

    `parameters` are the node's overrides, `params_file` the one of the package's config/ it is started with;
    `reliable` says whether the robot's sensors are published reliably, `may_refuse` that a node which does not come up
    is no failure in itself. `beside` are executables that run beside the node and `remappings` the node's names, each
    as name -> new name; `real_time` says that the clock goes like the one on the wall, for a script of the package's.
    `launch` is the package's launch file (or OWN_LAUNCH, ours) that is run instead of the node by itself, with changed
    parameter files (config.py) and `use_sim_time` as its argument; the trial begins when all the nodes in `awaits` are
    there.
    """

    name: str
    sentence: str
    script: Script
    node: str
    world: str
    serves: tuple[str, ...]
    parameters: Mapping[str, object] = field(default_factory=dict)
    params_file: str = ""
    reliable: bool = True
    may_refuse: bool = False
    beside: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    remappings: Mapping[str, str] = field(default_factory=dict)
    real_time: bool = False
    launch: str = ""
    awaits: tuple[str, ...] = ()
    use_sim_time: bool = True


_PLANS: dict[str, TrialPlan] = {}


def trial(
    *,
    serves: Iterable[str],
    node: str = "robot_controller",
    world: str = "lone_post",
    parameters: Mapping[str, object] | None = None,
    params_file: str = "",
    reliable: bool = True,
    may_refuse: bool = False,
    beside: Mapping[str, Mapping[str, str]] | None = None,
    remappings: Mapping[str, str] | None = None,
    real_time: bool = False,
    launch: str = "",
    awaits: tuple[str, ...] = (),
    use_sim_time: bool = True,
) -> Callable[[Script], Script]:
    """Enter the decorated script into the list of trials, under its own name; its docstring is the trial's sentence."""

    def enter(script: Script) -> Script:
        name = script.__name__
        if name in _PLANS:
            raise ValueError(f"two trials are called {name}")
        sentence = (script.__doc__ or "").strip().partition("\n")[0]
        _PLANS[name] = TrialPlan(
            name, sentence, script, node, world, tuple(serves), parameters or {}, params_file, reliable, may_refuse,
            beside or {}, remappings or {}, real_time, launch, awaits, use_sim_time,
        )  # fmt: skip
        return script

    return enter


def trials() -> dict[str, TrialPlan]:
    """Return every trial by its name. Each module of grader/trials/scripts is read; adding a file adds its trials."""
    folder = Path(__file__).parent / "scripts"
    for module in sorted(pkgutil.iter_modules([str(folder)]), key=lambda found: found.name):
        importlib.import_module(f"{SCRIPTS}.{module.name}")
    return dict(_PLANS)


def serving(requirements: Iterable[str]) -> dict[str, TrialPlan]:
    """Return the trials that at least one of the requirements needs."""
    wanted = set(requirements)
    return {name: plan for name, plan in trials().items() if wanted & set(plan.serves)}
