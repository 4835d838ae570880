"""What of a package's modules its nodes can come to, and which modules are a node's own. By names alone, and generous.

Whatever a name in reached code may refer to is reached: functions, methods of any class, properties, callbacks,
partials, names in strings for `getattr` and entry points. Nothing is run, and nothing else of the text counts.
"""

from __future__ import annotations

import ast
import fnmatch
import glob
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import TypeGuard

from grader.course import Course, role
from grader.intake.package_xml import read_package_xml
from grader.python_ast import Function, called, first_line, inner, is_docstring, last_name, parse, terms
from grader.quality import source_files
from grader.quality.parsed_module import Imports, Module, imports, installed_as
from grader.sandbox import untrusted

# Methods that rclpy calls on a node by themselves, beside those that are registered by name.
_CALLED_BY_RCLPY = {
    "destroy_node", "destroy", "get_logger", "get_clock", "get_name", "get_namespace", "on_configure", "on_activate",
    "on_deactivate", "on_cleanup", "on_shutdown", "on_error",
}  # fmt: skip
_NODE_BASES = {"Node", "LifecycleNode"}
_MAKES_A_NODE = {*_NODE_BASES, "create_node"}
# Classes whose machinery calls no method of a subclass by a name of its own.
_SILENT_BASES = {"object", "ABC", "Protocol", "Generic", "Enum", "IntEnum", "StrEnum", "NamedTuple", "TypedDict"}
# Decorators that hand the function to nobody.
_SILENT_DECORATORS = {
    "staticmethod", "classmethod", "property", "cached_property", "setter", "getter", "deleter", "abstractmethod",
    "override", "overload", "final", "wraps", "cache", "lru_cache", "contextmanager", "asynccontextmanager",
    "dataclass", "total_ordering", "singledispatch", "no_type_check", "unique", "runtime_checkable",
}  # fmt: skip
_LOOKS_UP = {"getattr", "hasattr", "methodcaller", "attrgetter", "import_module", "__import__"}
_LISTS_NAMES = {"dir", "vars", "globals", "locals", "getmembers"}
_LISTS_MODULES = {"iter_modules", "walk_packages"}
_WORD = re.compile(r"[^\W\d][\w.]*")
_MAX_SETTINGS = 100_000  # bytes
_MAX_STRING = 300  # a longer string is prose
_LOOKUPS_AT_MOST = 200  # each goes through all names of the package


@dataclass(frozen=True)
class Reachability:
    """Which code the nodes can come to.

    `homes` are each node's own modules: the one of its name or its executable's, and those that hold its class and
    the package's classes above it, unless they serve the other node too. A node that has none is left out.
    `unreached` are the lines of each module that no node, script or launch file can come to.
    """

    homes: Mapping[str, frozenset[str]] = field(default_factory=dict)
    unreached: Mapping[str, frozenset[int]] = field(default_factory=dict)
    bodies: Mapping[str, frozenset[int]] = field(default_factory=dict)
    """The lines inside functions, which importing does not run."""
    of_contract: bool = False
    """Whether there is a module of the contract: a node's or that of the functions."""


def reachability(
    package: Path,
    texts: Mapping[str, str],
    started: Mapping[str, str | bytes] = MappingProxyType({}),
    *,
    course: Course,
) -> Reachability:
    """Return what the nodes of `package` can come to in its modules, given by path with their texts.

    `started` are the texts of installed programs, and of other files that are no modules. A module that cannot be
    parsed counts as reached.
    """
    made = [Module(path, tree, 0, "script") for path, text in started.items() if (tree := parse(text))]
    programs = [*made, *_programs(package, course)]
    parsed = [Module(path, tree, 0, "module") for path, text in texts.items() if (tree := parse(text))]
    named = installed_as([*parsed, *programs], read_package_xml(package / "package.xml").name)
    modules = {module.path: module for module in named[: len(parsed)]}
    graph = _Names(modules)
    own = {node: path for node in course.nodes if (path := _own_module(node, modules, programs, _settings(package)))}
    functions = [path for path in modules if course.functions and _inside(path) == _inside(course.functions.module)]
    for path in (*own.values(), *functions):
        graph.reach_module(path)
    graph.mention({"main", *course.function_names})
    for path in own.values():
        graph.mention(class_.name for class_ in graph.classes_in(path) if graph.is_node(class_.name))
    for program in programs:
        graph.reach_program(program)
    graph.reach_strings(_settings(package))
    return Reachability(
        homes=_homes(own, graph),
        unreached=graph.unreached(),
        bodies={path: frozenset(_bodies(module.tree)) for path, module in modules.items()},
        of_contract=bool(own or functions),
    )


def _programs(package: Path, course: Course) -> Iterator[Module]:
    """Yield the Python files that are started rather than imported: scripts, launch files, setup.py."""
    for source in source_files.find(package, course):
        what = role(source.path, course.package)
        if what in ("script", "launch", "setup") and not source.problem:
            tree = parse(source.data)
            if tree is not None:
                yield Module(source.path, tree, 0, what)


def _settings(package: Path) -> str:
    """Return the text of setup.cfg, which may name entry points."""
    return untrusted.read_text(package / "setup.cfg", _MAX_SETTINGS, errors="replace") or ""


def _own_module(node: str, modules: Mapping[str, Module], programs: Sequence[Module], settings: str) -> str:
    """Return the path of a node's module; "" if there is none.

    A program that makes a node by itself, or with a file that is no module, has the module with this text, and no
    other. Else the node's name decides, or what its executable imports.
    """
    program = next((program for program in programs if program.role == "script" and program.stem == node), None)
    if maker := next(filter(lambda each: makes_a_node(each.tree), _started_by(program, programs)), None):
        text = ast.dump(maker.tree)
        return next((path for path, module in modules.items() if ast.dump(module.tree) == text), "")
    named = sorted((path for path, module in modules.items() if module.stem == node), key=lambda p: (p.count("/"), p))
    if named:
        return named[0]
    by_name = {module.name: path for path, module in modules.items()}
    entry_points = [settings, *(text for program in programs for text in _strings(program.tree))]
    for text in entry_points:
        if (match := re.search(rf"\b{node}\s*=\s*([\w.]+)\s*:", text)) and match[1] in by_name:
            return by_name[match[1]]
    started = sorted(imports(program).modules) if program is not None else []
    return next((by_name[name] for name in started if name in by_name and "." in name), "")


def _started_by(program: Module | None, programs: Sequence[Module]) -> list[Module]:
    """Return a program and the files among `programs` that it imports by their names, directly or not."""
    by_stem = {each.stem: each for each in programs if each.role == "script"}
    started, todo = dict[str, Module](), [program] if program is not None else []
    while todo:
        module = todo.pop()
        started[module.stem] = module
        names = {name.partition(".")[0] for name in imports(module).modules}
        todo += [by_stem[name] for name in names & by_stem.keys() - started.keys()]
    return list(started.values())


def makes_a_node(tree: ast.AST) -> bool:
    """Return whether a text makes a node of ROS itself, the contract's or another."""
    return any(
        called(part) in _MAKES_A_NODE
        or (isinstance(part, ast.ClassDef) and any(last_name(base) in _NODE_BASES for base in part.bases))
        for part in ast.walk(tree)
    )


def _homes(own: Mapping[str, str], graph: _Names) -> dict[str, frozenset[str]]:
    families = {node: {path, *graph.modules_of_the_node_in(path)} for node, path in own.items()}
    return {
        node: frozenset(
            path
            for path in family
            if path == own[node] or not any(path in other for name, other in families.items() if name != node)
        )
        for node, family in families.items()
    }


@dataclass(frozen=True)
class _Definition:
    """Something with a name: a function, a class, or a value at the top of a module; `owner` is a method's class."""

    path: str
    name: str
    parts: tuple[ast.AST, ...]
    """What is evaluated when it is used."""
    lines: range
    owner: str = ""
    handed_on: bool = False
    """Whether a decorator has got hold of it."""


class _Names:
    """The definitions of a package's modules, and which of them have been reached so far."""

    def __init__(self, modules: Mapping[str, Module]) -> None:
        self._modules = modules
        self._paths = {module.name: path for path, module in modules.items()}
        # "utils.motion" as well: a module may be named relative to its package.
        self._endings: dict[str, list[str]] = defaultdict(list)
        for module in modules.values():
            parts = module.name.split(".")
            for start in range(len(parts) - 1):
                self._endings[".".join(parts[start:])].append(module.path)
        self._imports: dict[str, Imports] = {path: imports(module) for path, module in modules.items()}
        self._definitions: dict[str, list[_Definition]] = defaultdict(list)
        self._at_import: dict[str, list[ast.AST]] = {}
        self._classes: dict[str, list[tuple[str, ast.ClassDef]]] = defaultdict(list)
        for path, module in modules.items():
            self._at_import[path] = []
            self._define(path, module.tree.body)
        self._by_name: dict[str, list[_Definition]] = defaultdict(list)
        for definition in (each for found in self._definitions.values() for each in found):
            self._by_name[definition.name].append(definition)
        self._mentioned: set[str] = set()
        self._reached: set[int] = set()
        self._reached_modules: set[str] = set()
        self._reached_classes: set[str] = set()
        self._looked_up: set[str] = set()
        self._todo: list[tuple[str, ast.AST]] = []
        self._is_following = False

    # -- reading

    def _define(self, path: str, body: Sequence[ast.stmt]) -> None:
        todo: list[ast.AST] = list(body)
        while todo:
            statement = todo.pop()
            if isinstance(statement, Function):
                self._add_function(path, statement, "")
            elif isinstance(statement, ast.ClassDef):
                self._add_class(path, statement)
            elif names := _plain_names(statement):
                value = getattr(statement, "value", None)
                parts = (value,) if value is not None and names != ["__all__"] else ()
                self._definitions[path] += [_Definition(path, name, parts, range(0)) for name in names]
            elif blocks := inner(statement):
                self._at_import[path] += _header(statement)
                todo += blocks
            elif not is_docstring(statement):
                self._at_import[path].append(statement)

    def _add_function(self, path: str, function: Function, owner: str) -> None:
        lines = range(first_line(function), (function.end_lineno or function.lineno) + 1)
        names = [called(item) or last_name(item) for item in function.decorator_list]
        handed_on = any(name not in _SILENT_DECORATORS for name in names)
        self._definitions[path].append(_Definition(path, function.name, (function,), lines, owner, handed_on))

    def _add_class(self, path: str, class_: ast.ClassDef) -> None:
        lines = range(first_line(class_), (class_.end_lineno or class_.lineno) + 1)
        methods = [item for item in class_.body if isinstance(item, Function)]
        classes = [item for item in class_.body if isinstance(item, ast.ClassDef)]
        rest = [item for item in class_.body if not isinstance(item, Function | ast.ClassDef)]
        parts = (*class_.bases, *class_.keywords, *class_.decorator_list, *rest)
        names = [called(item) or last_name(item) for item in class_.decorator_list]
        handed_on = any(name not in _SILENT_DECORATORS for name in names)
        self._classes[class_.name].append((path, class_))
        self._definitions[path].append(_Definition(path, class_.name, parts, lines, "", handed_on))
        for method in methods:
            self._add_function(path, method, class_.name)
        for item in classes:
            self._add_class(path, item)

    # -- classes

    def classes_in(self, path: str) -> list[ast.ClassDef]:
        """Return the classes that a module defines."""
        return [class_ for classes in self._classes.values() for where, class_ in classes if where == path]

    def _family(self, name: str) -> tuple[set[str], set[str]]:
        """Return the package's classes that a class is or inherits from, and the names of the others above it."""
        own, others, todo = set[str](), set[str](), [name]
        while todo:
            name = todo.pop()
            if name in own:
                continue
            if name not in self._classes:
                others.add(name)
                continue
            own.add(name)
            for path, class_ in self._classes[name]:
                todo += [self._original(path, last_name(_bare(base))) for base in class_.bases]
        return own, others

    def is_node(self, name: str) -> bool:
        """Return whether a class of the package is a node of rclpy's."""
        return name in self._classes and any(base.endswith("Node") for base in self._family(name)[1])

    def modules_of_the_node_in(self, path: str) -> set[str]:
        """Return the modules that make the node of a module: its own, or one that it imports, directly or not.

        They are those in which a node is made, and those of the package's classes above a class of these. A module that
        only imports, such as `from .impl import main`, has those from which it does.
        """
        todo, seen = [path], set[str]()
        while todo:
            seen.add(here := todo.pop())
            todo += {*self._imported(self._imports[here].modules)} - seen
        makers = {
            here
            for here in seen
            if makes_a_node(self._modules[here].tree) or any(self.is_node(c.name) for c in self.classes_in(here))
        }
        names = {class_.name for here in makers for class_ in self.classes_in(here) if self.is_node(class_.name)}
        family = {above for name in names for above in self._family(name)[0]}
        if not any(isinstance(part, Function) for part in ast.walk(self._modules[path].tree)):
            makers |= {self._paths[name] for name in self._imports[path].modules if name in self._paths and "." in name}
        return makers | {where for name in family for where, _ in self._classes[name]}

    def _original(self, path: str, name: str) -> str:
        """Return what a name was called where it was imported from."""
        return self._imports[path].names.get(name, ("", ""))[1] or name

    # -- reaching

    def reach_module(self, path: str) -> None:
        """Importing a module runs what stands at its top, and imports others."""
        todo = [path]
        while todo:
            path = todo.pop()
            if path in self._reached_modules:
                continue
            self._reached_modules.add(path)
            todo += self._imported(self._imports[path].modules)
            self._follow(path, self._at_import[path])
            for definition in self._definitions[path]:
                if definition.name in self._mentioned or definition.handed_on:
                    self._use(definition)

    def reach_program(self, program: Module) -> None:
        """A program imports modules and uses names."""
        imported = imports(program)
        for path in self._imported(imported.modules):
            self.reach_module(path)
        self.mention(original for _, original in imported.names.values() if original)
        self.mention(last_name(part) for part in ast.walk(program.tree))
        for text in _strings(program.tree):
            self.reach_strings(text)

    def reach_strings(self, text: str) -> None:
        """A string may name modules and what is in them: "package.module:function"."""
        words = [word.strip(".") for word in _WORD.findall(text)]
        for word in words:
            self._reach_named_module(word)
        self.mention(word.rpartition(".")[2] for word in words)

    def mention(self, names: Iterable[str]) -> None:
        """Reach whatever has one of these names."""
        for name in names:
            if name not in self._mentioned:
                self._mentioned.add(name)
                for definition in self._by_name.get(name, ()):
                    self._use(definition)

    def unreached(self) -> dict[str, frozenset[int]]:
        """Return the lines of what was not reached, by module."""
        lines_of: dict[str, frozenset[int]] = {}
        for path, module in self._modules.items():
            if path not in self._reached_modules:
                last = max((getattr(item, "end_lineno", 0) or 0 for item in module.tree.body), default=0)
                lines = set(range(1, last + 1))
            else:
                left = (each for each in self._definitions[path] if id(each) not in self._reached)
                lines = {line for each in left for line in each.lines}
            if lines:
                lines_of[path] = frozenset(lines)
        return lines_of

    def _imported(self, names: Iterable[str]) -> Iterator[str]:
        """Yield the paths of imported modules, with the packages they are in."""
        for name in names:
            parts = name.split(".")
            for end in range(1, len(parts) + 1):
                if path := self._paths.get(".".join(parts[:end])):
                    yield path

    def _reach_named_module(self, name: str) -> None:
        for known in (name, name.rpartition(".")[0]):
            for path in self._endings.get(known, ()) if "." in name else ():
                self.reach_module(path)

    def _use(self, definition: _Definition) -> None:
        if id(definition) in self._reached or definition.path not in self._reached_modules:
            return
        if definition.owner and not self._is_used_method(definition):
            return
        self._reached.add(id(definition))
        self._follow(definition.path, definition.parts)
        if any(path == definition.path for path, _ in self._classes.get(definition.name, ())):
            self._reached_classes.add(definition.name)
            for method in self._definitions[definition.path]:
                if method.owner == definition.name:
                    self._use(method)

    def _is_used_method(self, method: _Definition) -> bool:
        if method.owner not in self._reached_classes:
            return False
        if method.name in self._mentioned or method.handed_on or _is_dunder(method.name):
            return True
        others = {name for name in self._family(method.owner)[1] if not _is_silent_base(name)}
        return method.name in _CALLED_BY_RCLPY if others <= _NODE_BASES else True

    def _follow(self, path: str, parts: Iterable[ast.AST]) -> None:
        """Reach what some code may refer to, and so on. Without recursion: a chain of calls may be very long."""
        self._todo += [(path, part) for part in parts]
        if self._is_following:
            return
        self._is_following = True
        while self._todo:
            self._follow_one(*self._todo.pop())
        self._is_following = False

    def _follow_one(self, path: str, top: ast.AST) -> None:
        for part in _walk_code(top):
            name = last_name(part)
            self.mention((name, self._original(path, name)))
            if isinstance(part, ast.Call):
                self._follow_lookup(path, part)
            elif isinstance(part, ast.Constant) and _is_name(part.value):
                self.reach_strings(part.value.replace(":", " "))

    def _follow_lookup(self, path: str, call: ast.Call) -> None:
        """Reach what a call looks up by a name that it makes, or by listing all names."""
        name = called(call)
        if name in _LISTS_NAMES:
            self.mention(each.name for each in self._definitions[path])
        elif name in _LISTS_MODULES:
            for other in self._modules:
                self.reach_module(other)
        elif name in _LOOKS_UP:
            for given in call.args:
                pattern = _pattern(given)
                if pattern and pattern.pattern not in self._looked_up and len(self._looked_up) < _LOOKUPS_AT_MOST:
                    self._looked_up.add(pattern.pattern)
                    self.mention([known for known in self._by_name if pattern.fullmatch(known)])
                    for module, where in self._paths.items():
                        if pattern.fullmatch(module):
                            self.reach_module(where)


def _inside(path: str) -> tuple[str, ...]:
    """Return the parts of a path below the folder of the Python package, whatever that is called."""
    return PurePosixPath(path).parts[1:]


def _bodies(tree: ast.Module) -> Iterator[int]:
    for node in ast.walk(tree):
        if isinstance(node, Function):
            first = node.body[1] if is_docstring(node.body[0]) and len(node.body) > 1 else node.body[0]
            # What stands on the line of the `def` seems to run on import.
            yield from range(max(first_line(first), node.lineno + 1), (node.end_lineno or node.lineno) + 1)


def _plain_names(statement: ast.AST) -> list[str]:
    """Return the names to which a statement gives a value without calling anything; [] for any other statement."""
    targets: list[ast.expr] = []
    if isinstance(statement, ast.Assign):
        targets = statement.targets
    elif isinstance(statement, ast.AnnAssign):
        targets = [statement.target]
    if not targets or any(isinstance(part, ast.Call) for part in ast.walk(statement)):
        return []
    names = [target.id for target in targets if isinstance(target, ast.Name)]
    return names if len(names) == len(targets) else []


def _header(statement: ast.AST) -> list[ast.AST]:
    return [part for part in ast.iter_child_nodes(statement) if isinstance(part, ast.expr | ast.withitem)]


def _strings(tree: ast.AST) -> list[str]:
    nodes = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant))
    return [value for value in nodes if isinstance(value, str) and len(value) <= _MAX_STRING]


def _pattern(node: ast.expr) -> re.Pattern[str] | None:
    """Return what an f-string can come to, or a sum with a string; None for anything else, and if that is anything."""
    parts = node.values if isinstance(node, ast.JoinedStr) else terms(node)
    texts = [str(part.value) if isinstance(part, ast.Constant) else None for part in parts]
    if (len(texts) < 2 and not isinstance(node, ast.JoinedStr)) or not any(texts):
        return None
    # As for a shell's "*", which takes linear time whatever the student has put between.
    return re.compile(fnmatch.translate("".join("*" if text is None else glob.escape(text) for text in texts)))


def _bare(base: ast.expr) -> ast.expr:
    """Return `Base` for `Base[int]`."""
    return base.value if isinstance(base, ast.Subscript) else base


def _is_silent_base(name: str) -> bool:
    return name in _SILENT_BASES or name.endswith(("Error", "Exception", "Warning"))


def _is_name(value: object) -> TypeGuard[str]:
    """Return whether a constant may name something, as in "package.module:function"."""
    return isinstance(value, str) and len(value) <= _MAX_STRING and bool(re.fullmatch(r"[\w.:]+", value))


def _is_dunder(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")


def _walk_code(top: ast.AST) -> Iterator[ast.AST]:
    """Yield a node and all below it, without docstrings and other bare strings."""
    todo = [top]
    while todo:
        node = todo.pop()
        if not is_docstring(node):
            yield node
            todo += ast.iter_child_nodes(node)
