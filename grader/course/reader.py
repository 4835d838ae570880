"""Read a course from its folder: course.yaml and contract/contract.yaml. Each mistake is named with file and line."""

from __future__ import annotations

import ast
import importlib
import os
import re
import sys
from collections.abc import Callable, Iterable
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

import yaml

from grader import KIT, words, yaml_reader
from grader.course.model import Course, Functions, GoalFields, Node, Parameter
from grader.errors import GraderError
from grader.sanitize import printable
from grader.scoring.rubric import RUBRIC
from grader.words import mark, say
from grader.yaml_reader import YamlReader

COURSE, CONTRACT = "course.yaml", "contract/contract.yaml"
VARIABLE = "ROS2_COURSE"
"""The environment variable with the folder of the course, where no `--course` names it."""
INSTALLED = "grader/course/installed.txt"
"""In a kit that was made for a course of one's own: the folder of the course, seen from the kit's."""
_ROLES = ("subscribes", "publishes", "services", "actions")
_FIELDS = {"answers_every": "answers_every_s", "ahead": "ahead_deg"}  # of a Node, where they have other names


@cache
def kits_own() -> Course:
    """Return the kit's own course: the one that is graded by the rubric at the kit's top.

    Raises:
        GraderError: this is the students' kit of another course.
    """
    own = next((course for course in map(load, _kits()) if course.rubric == RUBRIC), None)
    if own is None:
        raise GraderError(f"This kit has no {RUBRIC.name}: it is for another course. Name a course with --course.")
    return own


def named(name: str) -> Course:
    """Return the course in the folder `name`, and the kit's own for "", and speak its language from here on."""
    return _chosen(load(Path(name)) if name else kits_own())


def name_of(course: Course) -> str:
    """Return the name by which `named` finds a course, on another machine, too, if the kit's own is meant."""
    return "" if course.rubric == RUBRIC else str(course.folder)


def find(chosen: Path | None = None) -> Course:
    """Return the course in the folder `chosen`, or in $ROS2_COURSE, or that of the installed kit.

    A course is code that is trusted, so none is taken because of the current folder; but among those that are part of
    the kit, that of the current folder is meant. Its language is spoken from here on.

    Raises:
        GraderError: as by `load`.
    """
    named = chosen or (Path(os.environ[VARIABLE]) if os.environ.get(VARIABLE) else None)
    if named:
        return _chosen(load(named.resolve()))
    here, added = Path.cwd(), _added()
    folder = next((folder for folder in (*added, *_kits()) if here.is_relative_to(folder)), next(iter(added), None))
    return _chosen(load(folder) if folder else kits_own())


def passed_over() -> str:
    """Return a note on a course in the current folder or above it, which is not used; "" if there is none."""
    if os.environ.get(VARIABLE):
        return ""
    here = Path.cwd()
    known = (*_added(), *_kits())
    folders = (here, *here.parents)
    found = next((folder for folder in folders if (folder / COURSE).is_file() and folder not in known), None)
    if found is None:
        return ""
    words = mark(
        "{whole}/{name} is not used. If that course is yours, add: --course {folder}, or set {variable}={whole}"
    )
    return say(words, whole=printable(str(found)), name=COURSE, folder=os.path.relpath(found), variable=VARIABLE)


def _added() -> list[Path]:
    """Return the folder of the course for which this kit was made, none for the kit's own."""
    installed = KIT / INSTALLED
    return [KIT / installed.read_text(encoding="utf-8").strip()] if installed.is_file() else []


def _kits() -> list[Path]:
    """Return the folders of the kit's own courses."""
    return sorted(path.parent for path in (KIT / "grader" / "courses").glob(f"*/{COURSE}"))


def _chosen(course: Course) -> Course:
    words.speak(course.language, course.folder)
    return course


def load(folder: Path) -> Course:
    """Return the course in `folder`.

    Raises:
        GraderError: a file cannot be read, names something unknown, or lacks something; it says which line.
    """
    return loaded(folder.resolve())  # a relative path is another folder's when the working folder has changed


@cache
def loaded(folder: Path) -> Course:
    """Return the course in a folder, given by its resolved path, read once in a process; see `load`."""
    reader, places, wrong = _Reader(), ("solution", "notebooks"), list[str]()
    needs = f"A course needs {COURSE} and {CONTRACT}."
    root = yaml_reader.read(folder / COURSE, needs)
    parts: dict[str, Any] = {}
    with yaml_reader.noted(wrong):
        fields = reader.fields(root, root, ("title", "package", "rubric"), "a course", ("language", *places))
        parts |= {name: reader.text(fields[name]) for name in ("title", "package")}
        parts |= {name: reader.place(folder, fields[name]) for name in ("rubric", *places) if name in fields}
        if "language" in fields:
            known = words.languages()
            parts["language"] = reader.one_of(fields["language"], known, "a language that the kit has words in")
    with yaml_reader.noted(wrong):
        contract = yaml_reader.read(folder / CONTRACT, needs)
        parts |= reader.contract(contract, parts["package"]) if parts else {}
    yaml_reader.require_none(wrong)
    course = Course(folder=folder, **parts)
    for type_ in course.interfaces:
        if not (file := course.contract / course.interface_file(type_)).is_file():
            raise GraderError(f"{folder / CONTRACT} names the interface {type_}, and there is no {file}. Write it.")
    return course


def modules(*folders: Path) -> list[ModuleType]:
    """Return the Python modules in folders of a course, imported; they import each other as `from .other import x`."""
    return [importlib.import_module(name) for name in module_names(*folders)]


def module_names(*folders: Path) -> list[str]:
    """Return the names by which the Python modules in folders of a course are imported.

    Of two with the same name the first counts.
    """
    places = [*map(str, folders)]
    package = f"course_{sha256(':'.join(places).encode()).hexdigest()[:12]}"
    if package not in sys.modules:
        sys.modules[package] = ModuleType(package)
        sys.modules[package].__path__ = places
    names = sorted({path.stem for folder in folders for path in folder.glob("*.py") if path.stem != "__init__"})
    return [f"{package}.{name}" for name in names]


class _Reader(YamlReader):
    """Makes the parts of a course."""

    def place(self, folder: Path, node: yaml.Node) -> Path:
        """Return a path that is written relative to the course's folder, if it is there."""
        path = (folder / self.text(node)).resolve()
        if not path.exists() and path.suffix:  # a students' kit leaves the folder of the solution out
            self.fail(node, f"there is no {path}; correct the path, which is relative to {COURSE}")
        return path

    def contract(self, root: yaml.Node, package: str) -> dict[str, Any]:
        """Return the fields of a Course that its contract decides."""
        optional = ("interfaces", "launch", "functions", "goal", "demonstration", "words")
        fields = self.fields(root, root, ("nodes", "layout"), "a contract", optional)
        layout = self.texts(fields["layout"])
        interfaces = self.texts(fields["interfaces"]) if "interfaces" in fields else ()
        path = partial(self.one_of, known=layout, what="a path of the layout")
        nodes: dict[str, Node] = {}
        wrong: list[str] = []
        for name, key, value in self.mapping(fields["nodes"]):
            with yaml_reader.noted(wrong):
                self.require_known(f"{package}/{name}.py", key, layout, "a path of the layout")
                test = f"test/test_{name}.py"
                found = self._node(value, path, interfaces)
                nodes[name] = Node(name, f"{package}/{name}.py", test if test in layout else "", **found)
        yaml_reader.require_none(wrong)

        def launched(node: yaml.Node) -> dict[str, tuple[str, ...]]:
            node_of = partial(self.one_of, known=nodes, what="a node of the contract")
            return {path(key): tuple(map(node_of, self.items(value))) for _, key, value in self.mapping(node)}

        readers: dict[str, Callable[[yaml.Node], Any]] = {
            "launch": launched,
            "functions": lambda node: self.record(Functions, node, "functions", module=path, names=self.texts),
            "goal": lambda node: self.record(GoalFields, node, "a goal"),
            "demonstration": path,
            "words": self.texts,
        }
        others = {name: readers[name](value) for name, value in fields.items() if name in readers}
        return {"nodes": nodes, "layout": layout, "interfaces": interfaces, **others}

    def _node(self, node: yaml.Node, path: Callable[[yaml.Node], str], interfaces: tuple[str, ...]) -> dict[str, Any]:
        readers: dict[str, Callable[[yaml.Node], Any]] = {
            **dict.fromkeys(_ROLES, partial(self._types, interfaces=interfaces)),
            "config": path,
            "answers_on": self.text,
            "answers_every": self._number,
            "ahead": self._number,
            "parameters": lambda node: {name: self._parameter(value) for name, _, value in self.mapping(node)},
        }
        fields = self.fields(node, node, (), "a node", tuple(readers))
        found = {_FIELDS.get(name, name): readers[name](value) for name, value in fields.items()}
        if "answers_on" in fields:
            self.one_of(fields["answers_on"], found.get("publishes", {}), "a topic that it publishes")
        return found

    def _types(self, node: yaml.Node, interfaces: tuple[str, ...]) -> dict[str, str]:
        found = {}
        for name, _, value in self.mapping(node):
            found[name] = self.text(value)
            if found[name].count("/") != 2:  # without a package, so it is one of the course's own
                self.require_known(found[name], value, interfaces, "one of the course's interfaces")
        return found

    def _parameter(self, node: yaml.Node) -> Parameter:
        return self.record(
            Parameter, node, "a parameter", telltale=self._number,
            default=lambda value: self.text(value) if value.tag.endswith(":str") else self._number(value),
            refuses=lambda values: tuple(map(self._number, self.items(values))),
        )  # fmt: skip

    def _number(self, node: yaml.Node) -> float:
        try:
            return float(self.text(node))
        except ValueError:
            self.fail(node, f"{self.text(node)} is not a number")


@cache
def held_back_names(course: Course) -> frozenset[str]:
    """Return the names of the files that are held back, and of the trials and checks in them.

    Of the packages of a league the names of their folders count, not those of the files in them.
    """
    files = [path for path in course.held_back.rglob("*") if path.is_file() and path.suffix != ".pyc"]
    packages = [*course.held_back.glob("league/*/*/")]
    files = [path for path in files if not any(path.is_relative_to(package) for package in packages)] + packages
    return frozenset(name for path in files for name in (path.stem, *_functions(path)) if name != "__init__")


def held_back_words(found: Iterable[str]) -> re.Pattern[str]:
    """Return a pattern for each of these names as a whole word; of none it finds nothing."""
    return re.compile(rf"(?<!\w)(?:{'|'.join(sorted(map(re.escape, found), key=len, reverse=True)) or '(?!)'})(?!\w)")


def _functions(path: Path) -> list[str]:
    body = ast.parse(path.read_text(encoding="utf-8")).body if path.suffix == ".py" else ()
    functions = (node for node in body if isinstance(node, ast.FunctionDef))
    return [node.name for node in functions if node.decorator_list or node.name.startswith("test_")]
