"""The plan of a trial: what is run, in which world, and for which requirements. Data only."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim import World

NAMESPACE = "robot7"
"""Where a launch file of the course's own, in its folder trials/launch, puts the nodes."""


@dataclass(frozen=True)
class TrialPlan:
    """One trial.

    Attributes:
        sentence: what happens in it, for the instructor.
        script: what is done; it takes a Stage.
        node: the node under test; without it the contract's first.
        world: a file in the course's folder worlds, or one of those that `python -m sim` lists.
        serves: the requirements that the trial is evidence for, beside those whose checks need trials of its `kind`.
        kind: what a stock trial is about (stock.py), "" for any other.
        parameters: overrides of the node's parameters.
        world_parameters: further overrides, made from the world as the seed has turned, mirrored and shifted it:
            `lambda world: {"dock": [world.start.x, world.start.y]}`.
        params_file: the file in the package's config/ that the node is started with.
        beside: other executables that run beside the node, each with its remappings.
        remappings: the node's remappings, old name -> new name.
        real_time: keep simulated time in step with wall time, for a script of the package's own.
        mostly_waits: it needs little of a core, so it runs beside the others. It changes no verdict.
        follows: the trial after which it may go on with the same running node, if that trial went to its end. Nothing
            of that trial may show in it. Both start the node alike.
        at_rest: brings the node to rest before, in the world `lone_post`; returns whether it is as when it had come up.
            If not, the node is started afresh.
        takes_long: it begins before the others, so that they do not wait for it in the end. It changes no verdict.
        notes_functions: the node notes which of the package's functions run: on these, quality and tests are measured.
            Of a node without such a trial it is its stock trial `idle_NODE`.
        launch: the launch file to run instead of the node alone, with changed parameter files (parameter_files.py):
            the package's or, in a trial with a `namespace`, the course's own.
        awaits: the nodes that must be up before a trial with `launch` begins.
        namespace: of the nodes, in which the course's own launch file starts them.
        use_sim_time: the launch file's argument of that name; None to give it no argument.
        shows_source: the sandbox shows the package's source folder, for a script of it. What is not installed is
            nothing that a node should run.
        case: the data that the script does, if they are its own (case.py): a trial that is in no list of a course.
    """

    name: str
    sentence: str
    script: Callable[[Any], None]
    node: str = ""
    world: str = "lone_post"
    serves: tuple[str, ...] = ()
    kind: str = ""
    parameters: Mapping[str, object] = field(default_factory=dict)
    world_parameters: Callable[[World], Mapping[str, object]] = lambda _world: {}
    params_file: str = ""
    beside: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    remappings: Mapping[str, str] = field(default_factory=dict)
    real_time: bool = False
    mostly_waits: bool = False
    follows: str = ""
    at_rest: Callable[[Any], bool] = lambda _stage: True
    takes_long: bool = False
    notes_functions: bool = False
    launch: str = ""
    awaits: tuple[str, ...] = ()
    namespace: str = ""
    use_sim_time: bool | None = True
    shows_source: bool = False
    case: Mapping[str, Any] | None = None

    @property
    def start(self) -> tuple[object, ...]:
        """Return all that decides how the node is started, but for what depends on the world."""
        return (
            self.node, self.parameters, self.world_parameters, self.params_file, self.beside, self.remappings,
            self.real_time, self.launch, self.namespace, self.use_sim_time, self.shows_source,
        )  # fmt: skip

    def placed_in(self, world: World) -> TrialPlan:
        """Return the plan with those of its node's parameters that depend on the world."""
        return replace(self, parameters={**self.parameters, **self.world_parameters(world)})
