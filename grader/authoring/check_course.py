"""Find what is wrong in the files of a course. Nothing is graded; course_trials.py does that."""

from __future__ import annotations

import ast
import contextlib
import importlib
import re
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import jinja2
import nbformat

from grader import yaml_reader
from grader.authoring import held_back, notebook_source
from grader.checks import checks_run
from grader.course import Course, handout, load
from grader.course.reader import CONTRACT, module_names, modules
from grader.errors import GraderError
from grader.intake import package_edits
from grader.intake.package_edits import Edit
from grader.league import pool
from grader.league.source import LeagueCases
from grader.notebook.checkpoints import Checkpoint
from grader.scoring import rubric
from grader.scoring.rubric import Rubric
from grader.trials import catalog
from grader.trials.plan import TrialPlan
from grader.trials.promises import hunts
from grader.yaml_reader import YamlReader, unknown
from sim.world import WorldError, load_world, world_names


@dataclass(frozen=True)
class KnownBad:
    """An edit of the solution that has to lose points."""

    path: Path
    edit: Edit
    loses: dict[str, float]


def mistakes(folder: Path) -> list[str]:
    """Return the mistakes in the files of the course in `folder`, each with its file and line."""
    try:
        course = load(folder)
    except GraderError as error:
        return shortened(folder.resolve(), [str(error)])
    return shortened(course.folder, _Reading(course).mistakes())


def read_rubric(course: Course) -> Rubric:
    """Return the course's rubric, whose checks exist."""
    return rubric.load(course.rubric, checks_run.known(course))


def worth(whole: Rubric) -> dict[str, float | None]:
    """Return the points of each requirement."""
    return {requirement.id: requirement.points for requirement in whole.requirements}


def edits(course: Course) -> list[Path]:
    """Return the files of a course's known-bad edits."""
    return sorted((course.folder / "known_bad").glob("*.yaml"))


def known_bad(path: Path, course: Course, worth: Mapping[str, float | None]) -> KnownBad:
    """Return the known-bad edit in a file. `worth` has the points of each requirement, None where they are not known.

    Raises:
        GraderError: it names what does not exist, does not fit the solution, or loses more than there is.
    """
    reader, root = YamlReader(), yaml_reader.read(path)
    given = reader.fields(root, root, ("file", "old", "new", "loses"), "a known-bad edit")
    edit: Edit | None = None
    loses: dict[str, float] = {}
    wrong: list[str] = []
    with yaml_reader.noted(wrong):
        edit = package_edits.read(reader, given, course.solution)
    for name, key, value in reader.mapping(given["loses"]):
        with yaml_reader.noted(wrong):
            reader.require_known(name, key, worth, "a requirement of the rubric")
            loses[name] = float(reader.points(value, worth[name], name))
    yaml_reader.require_none(wrong)
    if not any(loses.values()):
        reader.fail(given["loses"], "an edit that loses nothing shows nothing; write `loses: {ID: points}`")
    assert edit is not None
    return KnownBad(path, edit, loses)


class _Reading:
    """Reads one course. Each method yields the mistakes of one kind of file."""

    def __init__(self, course: Course) -> None:
        self.course = course
        self._sound: Rubric | None = None  # it names only checks that exist
        with contextlib.suppress(Exception):  # named by _rubric and _checks
            self._sound = read_rubric(course)
        self.whole = self._sound  # or as far as it goes; None if it cannot be read
        with contextlib.suppress(GraderError):
            self.whole = self._sound or rubric.load(course.rubric)
        text = course.rubric.read_text(encoding="utf-8") if course.rubric.is_file() else ""
        ids: dict[str, float | None] = dict.fromkeys(re.findall(r"(?m)^ *- id: *[\"']?(\w+)", text))
        self.worth = worth(self.whole) if self.whole else ids

    def mistakes(self) -> Iterator[str]:
        """Yield all mistakes. What was made of a file with a mistake is not asked for more."""
        of_solution: tuple[Callable[[], Iterator[str]], ...] = (self._layout, self._known_bad, self._notebooks)
        if not (self.course.solution / "package.xml").is_file():
            place, lacking = _line(self.course.folder / "course.yaml", "solution"), self.course.solution
            yield f"{place}: there is no package in {lacking}; what refers to its files is read when there is"
            of_solution = ()
        parts = (self._rubric, self._checks, self._trials, self._held_back, self._worlds)
        for part in (*parts, self._hunts, self._functions, self._handout, *of_solution):
            try:
                yield from part()
            except GraderError as error:
                yield str(error)
            except Exception as error:  # of a module or a template of the course
                yield f"{_place(error, self.course.folder)}: {type(error).__name__}: {error}"

    def _layout(self) -> Iterator[str]:
        for path in self.course.layout:
            if not (self.course.solution / path).exists():
                yield f"{_line(self.course.path(CONTRACT), path)}: the solution has no {path}"

    def _rubric(self) -> Iterator[str]:
        wrong: list[str] = []
        with yaml_reader.noted(wrong):
            try:
                read_rubric(self.course)
            except SyntaxError:  # of a check, named by _checks
                rubric.load(self.course.rubric)
        yield from wrong
        if self.course.notebooks == Path() or self.whole is None:
            return
        headings: dict[str, set[str]] = {}
        for path in self.course.notebooks.glob("[0-9][0-9]_*.ipynb"):
            cells = nbformat.read(path, as_version=4).cells
            headings[path.stem] = {text for cell in cells for _, text in notebook_source.headings(cell)}
        for requirement in (requirement for requirement in self.whole.requirements if requirement.section):
            notebook, _, title = requirement.section.partition("#")
            if title not in headings.get(notebook, ()):
                place = f"the section of {requirement.id}, {requirement.section}"
                where = _line(self.course.rubric, requirement.section)
                yield f"{where}: no notebook in {self.course.notebooks} has {place}"

    def _imported(self, *folders: Path) -> Iterator[str]:
        """Yield which modules in folders of the course cannot be imported."""
        for name in module_names(*folders):
            try:
                importlib.import_module(name)
            except Exception as error:
                yield f"{_place(error, self.course.folder)}: {type(error).__name__}: {error}"

    def _checks(self) -> Iterator[str]:
        """Yield the checks that no requirement has, and the names in them that do not exist."""
        for folder in (self.course.folder, self.course.held_back):
            yield from self._imported(folder / "checks")
        for path, tree in self._parsed("checks", "check_*.py"):
            for check in tree.body:
                if isinstance(check, ast.FunctionDef) and check.name.startswith("test_") and self.whole:
                    yield from self._check(path, check, self.whole)

    def _check(self, path: Path, check: ast.FunctionDef, whole: Rubric) -> Iterator[str]:
        id_, needs = f"{path.stem}::{check.name}", checks_run.needs(self.course, path.stem)
        judged = [r.id for r in whole.requirements if id_ in {check.id for check in r.checks}]
        if not judged and self._sound:
            add = f'add {{id: "{id_}", points: 1}} to one in the rubric'
            yield f"{path}, line {check.lineno}: no requirement has the check {id_}; {add}"
        if not ast.get_docstring(check):
            yield f"{path}, line {check.lineno}: {id_} has no docstring, the sentence that students read"
        for call in ast.walk(check):
            match call:
                case ast.Call(ast.Attribute(ast.Name("judge"), "call"), [_, ast.Constant(str(name)), *_]):
                    yield from self._service(name, path, call.lineno)
                case ast.Call(
                    ast.Attribute(ast.Name("judge"), "trial" | "started" | "graph"), [ast.Constant(str(name)), *_]
                ) if self._plans is not None:
                    plan, where = self._plans.get(name), f"{path}, line {call.lineno}"
                    if plan is None:
                        yield f"{where}: {unknown(name, self._plans, 'a trial')}"
                    elif not plan.kind or plan.kind not in needs:
                        for lacking in [r for r in judged if r not in plan.serves]:
                            yield f"{where}: {id_} is of {lacking}, which the trial {name} does not serve; add it there"

    def _service(self, name: str, path: Path, line: int) -> Iterator[str]:
        known = [service for node in self.course.nodes.values() for service in node.services]
        if name not in known:
            yield f"{path}, line {line}: {unknown(name, known, 'a service of the contract')}"

    @cached_property
    def _plans(self) -> dict[str, TrialPlan] | None:
        """Return the trials, None if not all can be read."""
        try:
            return catalog.trials(self.course)
        except Exception:  # named by _trials
            return None

    def _trials(self) -> Iterator[str]:
        broken = list(self._imported(self.course.folder / "trials"))
        broken += self._imported(self.course.held_back / "trials")
        yield from broken
        if self._plans is None and not broken:
            catalog.trials(self.course)  # says what is wrong
        own = {path.stem for path in self.course.files("worlds", "*.yaml")}
        for plan in (self._plans or {}).values():
            code = plan.script.__code__
            place = f"{code.co_filename}, line {code.co_firstlineno}: the trial {plan.name}"
            if not plan.serves and not plan.kind:
                yield f"{place} serves no requirement; name those whose checks read it: @trial(serves=[...])"
            for name in plan.serves:
                if self.worth and name not in self.worth:
                    yield f"{place}: {unknown(name, self.worth, 'a requirement of the rubric')}"
            if plan.world not in {*own, *world_names()}:
                yield f"{place}: {unknown(plan.world, [*own, *world_names()], 'a world')}"
        for path, tree in self._parsed("trials", "*.py"):
            for call in ast.walk(tree):
                match call:
                    case ast.Call(ast.Attribute(ast.Name("stage"), "call"), [ast.Constant(str(name)), *_]):
                        yield from self._service(name, path, call.lineno)

    def _parsed(self, kind: str, pattern: str) -> Iterator[tuple[Path, ast.Module]]:
        """Yield the Python files among them that are Python; the others are named where they are imported."""
        for path in self.course.files(kind, pattern):
            with contextlib.suppress(SyntaxError):
                yield path, ast.parse(path.read_text(encoding="utf-8"))

    def _held_back(self) -> Iterator[str]:
        if self.whole is not None and self._plans is not None:
            yield from held_back.problems(self.course)
        league = bool(self.whole and checks_run.served(self.course, self.whole, LeagueCases.name))
        if league and self.course.solution.is_dir() and not any(package.broken for package in pool.read(self.course)):
            yield f"{self.course.rubric}: a league needs broken packages to catch, in held_back/league/broken"

    def _worlds(self) -> Iterator[str]:
        for path in self.course.files("worlds", "*.yaml"):
            try:
                load_world(path)
            except WorldError as error:
                yield str(error)

    def _known_bad(self) -> Iterator[str]:
        wrong: list[str] = []
        for path in edits(self.course):
            with yaml_reader.noted(wrong):
                known_bad(path, self.course, self.worth)
        yield from wrong

    def _hunts(self) -> Iterator[str]:
        """Yield which modules of hunts/ cannot be imported, and for which requirements they make up no cases."""
        broken = list(self._imported(self.course.folder / "hunts"))
        yield from broken
        known = () if broken else hunts(self.course).requirements
        for requirement in () if broken or self.whole is None else self.whole.requirements:
            if requirement.hunt and requirement.id not in known:
                where = _line(self.course.rubric, f"id: {requirement.id}")
                yield f"{where}: {unknown(requirement.id, known, 'what a module of hunts/ makes up cases for')}"

    def _functions(self) -> Iterator[str]:
        wanted = self.course.functions is not None
        if wanted and not any(hasattr(module, "questions") for module in modules(self.course.path("functions"))):
            yield f"{self.course.path('functions')}: no module defines questions(rng), which returns the cases"

    def _notebooks(self) -> Iterator[str]:
        path = self.course.folder / "notebooks.yaml"  # of an extended course another rubric may lack a requirement
        root = yaml_reader.read(path) if path.is_file() else None
        if root is None:
            return
        reader = YamlReader()
        parts = reader.fields(root, root, (), "", ("notebooks", "needs", "later", "stand_ins", "edits", "lanes"))
        wrong: list[str] = []
        for part in ("needs", "stand_ins"):
            for name, key, _ in reader.mapping(parts[part]) if part in parts and self.worth else ():
                with yaml_reader.noted(wrong):
                    reader.require_known(name, key, self.worth, "a requirement of the rubric")
        written = sorted(path.stem for path in self.course.notebooks.glob("[0-9][0-9]_*.ipynb"))
        for name, key, value in reader.mapping(parts["notebooks"]) if "notebooks" in parts else ():
            with yaml_reader.noted(wrong):
                reader.require_known(name, key, written, f"a notebook in {self.course.notebooks}")
                kinds = reader.fields(value, key, (), "", tuple(field.name for field in fields(Checkpoint)))
                for file in [file for kind in kinds.values() for file in reader.items(kind)]:
                    if not (self.course.solution / (lacking := reader.text(file))).is_file():
                        wrong.append(f"{path}, line {file.start_mark.line + 1}: the solution has no {lacking}")
        yield from wrong

    def _handout(self) -> Iterator[str]:
        if self.whole is None:
            return
        try:
            handout.render(self.whole, self.course)
        except jinja2.TemplateNotFound as error:
            yield f"{self.course.folder} has no {error}, the frame of the handout"
        except jinja2.TemplateSyntaxError as error:
            yield f"{error.filename}, line {error.lineno}: {error.message}"


def _place(error: Exception, folder: Path) -> str:
    """Return the last line of the course that an error came through."""
    if isinstance(error, SyntaxError):
        return f"{error.filename}, line {error.lineno}"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).is_relative_to(folder)]
    return f"{frames[-1].filename}, line {frames[-1].lineno}" if frames else str(folder)


def _line(path: Path, words: str) -> str:
    """Return the first place in a file where these words are."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return f"{path}, line {next((number for number, line in enumerate(lines, 1) if words in line), 1)}"


def shortened(folder: Path, words: Iterable[str]) -> list[str]:
    """Return each line once, with paths relative to the course's folder."""
    return [line.replace(f"{folder}/", "") for line in dict.fromkeys("\n".join(words).splitlines())]
