"""The contract of a course as types: what students' packages have to offer, under which names."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

import yaml

from grader.scoring import rubric
from grader.words import ENGLISH
from grader.yaml_reader import FAST_LOADER

JUDGED = ("module", "launch", "script")
"""The roles of files that run on the robot; tests and setup.py serve the author."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of a node.

    Attributes:
        default: a number, or a text.
        meaning: what it is for, with its unit.
        telltale: another sensible value, to see whether a parameter file reaches the node; None for none.
        refuses: values that make no sense, and that the node has to refuse.
        drawn: for a distance at which the robot does something else: its name in plots, which have a line there.
    """

    default: float | str
    meaning: str = ""
    telltale: float | None = None
    refuses: tuple[float, ...] = ()
    drawn: str = ""


@dataclass(frozen=True)
class Node:
    """A node of the contract; its executable has its name. Interfaces are types by name, such as "srv/SetSpeed".

    A type of the course's own has no package in it; others do: "sensor_msgs/msg/LaserScan".

    Attributes:
        module: the path of its module in the package.
        test: the path of its test.
        config: the path of its parameter file, "" for none.
        answers_on: the topic that it publishes when it has taken in a tick, by which simulated time goes on.
        answers_every_s: the default period of these messages, s.
        ahead_deg: how far to either side of its heading it looks for what is ahead.
    """

    name: str
    module: str
    test: str = ""
    config: str = ""
    answers_on: str = ""
    answers_every_s: float = 0.05
    ahead_deg: float = 90.0
    subscribes: Mapping[str, str] = field(default_factory=dict)
    publishes: Mapping[str, str] = field(default_factory=dict)
    services: Mapping[str, str] = field(default_factory=dict)
    actions: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Parameter] = field(default_factory=dict)

    @property
    def offers(self) -> dict[str, str]:
        """Return its services and actions with their types."""
        return {**self.services, **self.actions}

    @property
    def command(self) -> str:
        """Return the topic on which it commands the robot's velocity, "" if it does not."""
        return next((name for name, type_ in self.publishes.items() if type_ == "geometry_msgs/msg/Twist"), "")

    @property
    def names(self) -> list[str]:
        """Return the names of its topics, services and actions."""
        return [*self.subscribes, *self.publishes, *self.offers]

    @property
    def defaults(self) -> dict[str, float]:
        """Return the defaults of its numeric parameters."""
        return {name: p.default for name, p in self.parameters.items() if not isinstance(p.default, str)}

    def thresholds(self, values: Mapping[str, object]) -> dict[str, float]:
        """Return the distances that plots have a line for, by their names; `values` are other than the defaults."""
        found = {p.drawn: values.get(name, p.default) for name, p in self.parameters.items() if p.drawn}
        return {name: float(value) for name, value in found.items() if isinstance(value, int | float)}

    @property
    def telltales(self) -> dict[str, float]:
        """Return the telltales of its parameters that have one."""
        return {name: p.telltale for name, p in self.parameters.items() if p.telltale is not None}

    @property
    def refused(self) -> list[tuple[str, float]]:
        """Return the values that it has to refuse, each with the parameter's name."""
        return [(name, value) for name, p in self.parameters.items() for value in p.refuses]

    @property
    def refused_at_start(self) -> dict[str, float]:
        """Return one of these values, of its first parameter that has some."""
        return dict([value for value in self.refused if value[0] == self.refused[0][0]][-1:])


@dataclass(frozen=True)
class Functions:
    """The functions that are called with cases: those of one module, given by its path in the package."""

    module: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class GoalFields:
    """The fields of the course's action that sends a robot to a place.

    Attributes:
        target: of the goal, a geometry_msgs/Pose in the odom frame.
        tolerance: of the goal, m.
        remaining: of the feedback, the distance to the target, m.
        final: of the result, a geometry_msgs/Pose: where the robot is in the end.
        success: of the result, whether it has arrived.
    """

    target: str
    tolerance: str
    remaining: str
    final: str
    success: str


@dataclass(frozen=True, eq=False)
class Course:
    """Everything of one assignment. `folder` is where it is; other paths are absolute, those in a package relative.

    Attributes:
        package: the name of the package that students write.
        layout: the paths that the package has to have.
        launch: the launch files by their paths in the package, each with the nodes that it starts.
        interfaces: the course's own types, such as "srv/SetSpeed"; their files are in `contract`.
        goal: the fields of the action by which trials send the robot to a place, None if there is no such action.
        demonstration: the path of the script that shows the nodes at work, "" for none.
        words: further names that code has from the contract, such as frames and states.
        language: of what students read, such as "de".
    """

    folder: Path
    title: str
    package: str
    nodes: Mapping[str, Node]
    layout: tuple[str, ...]
    launch: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    interfaces: tuple[str, ...] = ()
    functions: Functions | None = None
    goal: GoalFields | None = None
    demonstration: str = ""
    words: tuple[str, ...] = ()
    language: str = ENGLISH
    rubric: Path = Path()
    solution: Path = Path()
    notebooks: Path = Path()

    @property
    def contract(self) -> Path:
        """Return the folder of a package that holds the course's interface files and nothing else."""
        return self.path("contract") / self.package

    @property
    def held_back(self) -> Path:
        """Return the folder of what students must not see, with folders `trials`, `checks` and `worlds`."""
        return self.folder / "held_back"

    def path(self, name: str) -> Path:
        """Return the path of a file or a folder of the course, which may not be there."""
        return self.folder / name

    def files(self, kind: str, pattern: str) -> list[Path]:
        """Return its "trials", "checks" or "worlds": those that students get, then those held back."""
        return [path for home in (self.folder, self.held_back) for path in sorted((home / kind).glob(pattern))]

    def world(self, name: str) -> str:
        """Return what `sim.load_world` takes for a world: a file of the course's own, or else its name."""
        return next(map(str, self.files("worlds", f"{name}.yaml")), name)

    @property
    def interfaces_package(self) -> str:
        """Return the name under which a submission may split its interfaces off."""
        return f"{self.package}_interfaces"

    @cached_property
    def modules(self) -> tuple[str, ...]:
        """Return the paths of the contract's modules: the nodes', and that of the functions."""
        return (*(node.module for node in self.nodes.values()), *([self.functions.module] if self.functions else []))

    @cached_property
    def shared(self) -> tuple[str, ...]:
        """Return the paths of the files that are installed in the package's share folder."""
        return tuple(path for path in self.layout if path.startswith(("launch/", "config/")))

    @property
    def builds(self) -> tuple[str, ...]:
        """Return the files without which no package builds."""
        return ("package.xml", "CMakeLists.txt" if "CMakeLists.txt" in self.layout else "setup.py")

    @cached_property
    def offered(self) -> dict[str, str]:
        """Return all services and actions with their types."""
        return {name: type_ for node in self.nodes.values() for name, type_ in node.offers.items()}

    @cached_property
    def topics(self) -> tuple[str, ...]:
        """Return the names of all topics, services and actions."""
        return tuple(dict.fromkeys(name for node in self.nodes.values() for name in node.names))

    @cached_property
    def telltales(self) -> dict[str, float]:
        """Return the telltales of all parameters that have one."""
        return {name: value for node in self.nodes.values() for name, value in node.telltales.items()}

    @cached_property
    def _judged(self) -> dict[str, str]:
        requirements = rubric.load(self.rubric).requirements
        return {check.module: r.id for r in reversed(requirements) for check in reversed(r.checks)}

    def requirement_of(self, module: str) -> str:
        """Return the id of the first requirement that a module of checks judges, "" if there is none."""
        return self._judged.get(module, "")

    @cached_property
    def notebook_table(self) -> dict[str, Any]:
        """Return what notebooks.yaml says: the notebooks with their files, and what checks in them need."""
        path = self.path("notebooks.yaml")
        found = yaml.load(path.read_text(encoding="utf-8"), FAST_LOADER) if path.is_file() else {}
        return {name: found.get(name, {}) for name in ("notebooks", "needs", "later", "stand_ins", "edits", "lanes")}

    def full_type(self, type_: str) -> str:
        """Return a type with its package: "my_package/srv/SetSpeed"."""
        return type_ if type_.count("/") == 2 else f"{self.package}/{type_}"

    def interface_file(self, type_: str) -> str:
        """Return the path of an interface's file in a package: "srv/SetSpeed.srv"."""
        return f"{type_}.{type_.partition('/')[0]}"

    def layout_of(self, paths: Collection[str], package: str) -> list[str]:
        """Return the layout of the package with these paths; its modules may be in a folder named like `package`."""
        names = (self.package, package)
        folder = next((name for name in names if any(path.startswith(f"{name}/") for path in paths)), self.package)
        return [path.replace(f"{self.package}/", f"{folder}/") for path in self.layout]


def launch_stem(path: str) -> str:
    """Return what a launch file is called for short: "bringup" for "launch/bringup_launch.py"."""
    return re.sub(r"[._]launch$", "", PurePosixPath(path).stem)


def role(path: str, package: str) -> str:
    """Return what a file of `package` is for: "module", "launch", "script", "test" or "setup".

    The nodes can import every file of the Python package, so none of them is a test or a launch file by its name.
    """
    parts = PurePosixPath(path).parts
    name = parts[-1]
    if parts[0] == package and len(parts) > 1:
        return "module"
    collected = name == "conftest.py" or re.fullmatch(r"(?s)test_.*\.py|.*_test\.py", name)
    if parts[0] in ("test", "tests") or (len(parts) == 1 and collected):
        return "test"
    if parts == ("setup.py",):
        return "setup"
    if parts[0] == "launch" or name.endswith((".launch.py", "_launch.py")):
        return "launch"
    # Python without `.py` was recognised by its first line, which makes it a program.
    in_scripts = parts[0] in ("scripts", "bin", "examples", "tools", "demo")
    return "script" if in_scripts or not name.endswith(".py") else "module"
