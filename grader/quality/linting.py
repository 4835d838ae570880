"""Lint parsed modules: missing docstrings and annotations, repeated blocks, and habits that hurt in a node.

A bare except, a print and a mutable default are not left to plugins of flake8: installed beside ament_flake8 these
would report in the student's own runs of it, too, and Q1 promises that those agree with the grader.
"""

from __future__ import annotations

import ast
import re
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from grader.course.model import JUDGED
from grader.evidence import Copy, Definition, Finding
from grader.python_ast import BODIES, Function, called, inner, is_docstring, last_name
from grader.quality.parsed_module import CallGraph, Module, imports, own_body
from grader.sanitize import printable

_MUTABLE = (ast.List, ast.Dict, ast.Set, ast.ListComp, ast.DictComp, ast.SetComp)
_MUTABLE_CALLS = ("list", "dict", "set", "bytearray", "defaultdict", "deque", "OrderedDict", "Counter")
# Calls that return when another callback has run, which it cannot as long as this one does.
_WAITS = {
    "rclpy.spin_until_future_complete": "`spin_until_future_complete`", "call": "a client's `call`",
    "wait_for_service": "`wait_for_service`", "wait_for_server": "`wait_for_server`",
    "send_goal": "an action client's `send_goal`",
}  # fmt: skip
_SPINS = ("rclpy.spin_until_future_complete", "rclpy.spin_once", "rclpy.spin")
_SLEEPS = ("time.sleep", "get_clock().sleep_for", "get_clock().sleep_until")
_WALL_CLOCKS = ("time.time", "time.monotonic", "time.perf_counter", "datetime.datetime.now", "datetime.datetime.utcnow")
SLEEP_IN_TEST = "sleep-in-test"
CALLED_AT_ONCE = "called-at-once"


def bad_habits(modules: Sequence[Module], graph: CallGraph) -> list[Finding]:
    """Return every finding. Scripts talk to a person, so they may print; tests are only asked whether they sleep.

    Most rules cost nothing: they explain what a trial sees.
    """
    found = [finding for module in modules if module.role != "test" for finding in _in_module(module)]
    found += [finding for module in modules if module.role == "test" for finding in _sleeps(module)]
    found += [*_in_callbacks(graph), *_without_response(graph), *_called_at_once(graph)]
    return sorted(found, key=lambda finding: (finding.path, finding.line))


def _sleeps(module: Module) -> Iterator[Finding]:
    meaning = imports(module).meaning
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Call) and meaning(node.func) == "time.sleep":
            yield Finding(module.path, node.lineno, SLEEP_IN_TEST, f"`{ast.unparse(node)[:60]}`")


def _without_response(graph: CallGraph) -> Iterator[Finding]:
    """Yield the callbacks of services that return nothing; rclpy ends the node with a bare TypeError then."""
    for node, service in graph.service_callbacks():
        body = list(own_body(node.function))
        returns = [part for part in body if isinstance(part, ast.Return)]
        if any(isinstance(part, ast.Raise) for part in body) or (returns and all(part.value for part in returns)):
            continue
        where = f"`{node.function.name}`, the callback of {service or 'a service'}, returns None"
        yield Finding(node.module.path, node.function.lineno, "no-response", where)


def _called_at_once(graph: CallGraph) -> Iterator[Finding]:
    """Yield `create_timer(1.0, self.tick())`: it hands over None, and rclpy ends the node when the timer is due."""
    for node, call, given in graph.called_callbacks():
        function = ast.unparse(given.func)
        where = f"`{last_name(call.func)}` gets what `{function}()` returns, None: write `{function}`"
        yield Finding(node.module.path, given.lineno, CALLED_AT_ONCE, where)


def _in_module(module: Module) -> Iterator[Finding]:
    for node in ast.walk(module.tree):
        if isinstance(node, ast.ExceptHandler) and node.type is None:
            yield Finding(module.path, node.lineno, "bare-except", "`except:` without a type")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print":
            if module.role == "module":
                yield Finding(module.path, node.lineno, "print", "`print` instead of the node's logger")
        elif isinstance(node, Function | ast.Lambda):
            name = getattr(node, "name", "lambda")
            for default in [*node.args.defaults, *node.args.kw_defaults]:
                if default and (isinstance(default, _MUTABLE) or called(default) in _MUTABLE_CALLS):
                    yield Finding(module.path, default.lineno, "mutable-default", f"`{name}` has a mutable default")


def _in_callbacks(graph: CallGraph) -> Iterator[Finding]:
    """Yield what keeps a callback from returning to the executor, and which other clocks it asks."""
    for node, root in graph.in_callbacks():
        imported = graph.imports[node.module.path]
        name = node.function.name
        where = f"in the callback `{name}`" if root == name else f"in `{name}`, called from the callback `{root}`"
        for part in own_body(node.function):
            if isinstance(part, ast.Call):
                meaning = imported.meaning(part.func)
                # `time.sleep` without the import raises a NameError, in the callback.
                called_as = f".{ast.unparse(part.func)}"
                slept = next((name for name in _SLEEPS if name == meaning or called_as.endswith(f".{name}")), "")
                if slept:
                    yield Finding(node.module.path, part.lineno, "sleep-in-callback", f"`{slept}` {where}")
                elif meaning in _WALL_CLOCKS:
                    yield Finding(node.module.path, part.lineno, "wall-clock", f"`{meaning}` {where}")
                elif meaning in _SPINS and part.args and last_name(part.args[0]) == "self":  # another node may be spun
                    yield Finding(node.module.path, part.lineno, "spin-in-callback", f"`{meaning}` {where}")
                elif what := _waits(part, meaning):
                    yield Finding(node.module.path, part.lineno, "wait-in-callback", f"{what} {where}")
            elif isinstance(part, ast.While) and _holds_on(part):
                yield Finding(node.module.path, part.lineno, "loop-in-callback", f"`while` {where}")


def _waits(call: ast.Call, meaning: str) -> str:
    """Return what a call waits for without a time limit, in words; "" if it does not wait for another callback."""
    if isinstance(call.func, ast.Attribute) and not meaning:
        limited = any(keyword.arg in ("timeout_sec", "timeout") for keyword in call.keywords)
        owner = last_name(call.func.value)
        # `call` is a common name; a client is called one, as a rule.
        if limited or (call.func.attr == "call" and "client" not in owner.lower() and owner.strip("_") != "cli"):
            return ""
        return _WAITS.get(call.func.attr, "")
    return _WAITS.get(meaning, "")


def _holds_on(loop: ast.While) -> bool:
    """Return whether a loop may go on for as long as another callback does not run: it awaits and yields nothing.

    A loop that counts, or takes from a list until it is empty, ends by itself.
    """
    body = [part for statement in loop.body for part in ast.walk(statement)]
    if any(isinstance(part, ast.Await | ast.Yield | ast.YieldFrom) for part in body):
        return False
    if isinstance(loop.test, ast.Constant) or called(loop.test) == "ok":
        return not any(isinstance(part, ast.Break | ast.Return | ast.Raise) for part in body)
    tested = {ast.unparse(part) for part in ast.walk(loop.test) if isinstance(part, ast.Attribute)}
    changed = {ast.unparse(part) for part in body if isinstance(getattr(part, "ctx", None), ast.Store)}
    calls = [part.func for part in body if isinstance(part, ast.Call)]
    used = {ast.unparse(function.value) for function in calls if isinstance(function, ast.Attribute)}
    return bool(tested) and not tested & (changed | used)


# flake8's own rules. With ROS from apt, ament_flake8 brings plugins for quotes, import order and more; the wheels do
# not depend on them, so a student who runs ament_flake8 here does not see their findings, and they cost nothing.
_RULES = re.compile(r"[EWF]\d")
_COMPLEX = "C901"
MAX_COMPLEXITY = 10
_LINE = re.compile(r"^(?:\./)?(\d{4}/[^:]+):(\d+):([A-Z]+\d+):(.*)$")
_MAX_FINDINGS = 500  # of one file


def by_flake8(copies: Mapping[str, str]) -> tuple[list[Finding], list[Finding]]:
    """Return flake8's findings under ament_flake8's configuration, and the functions that are too complex.

    `copies` are the paths of the files' copies, by the files' own.
    """
    import ament_flake8
    from flake8.main.application import Application  # type: ignore[import-untyped]

    paths, flake8 = {copy: path for path, copy in copies.items()}, Application()
    with tempfile.NamedTemporaryFile("r") as report:
        flake8.run([
            f"--config={Path(ament_flake8.__file__).parent / 'configuration' / 'ament_flake8.ini'}", "--disable-noqa",
            "--no-show-source", "--jobs=1", f"--max-complexity={MAX_COMPLEXITY}", f"--output-file={report.name}",
            "--format=%(path)s:%(row)d:%(code)s:%(text)s", *paths,
        ])  # fmt: skip
        if flake8.catastrophic_failure:
            raise RuntimeError("flake8 has failed")
        matches = [*filter(None, map(_LINE.match, report.read().splitlines()))]
    found = [Finding(paths[copy], int(row), rule, printable(text.strip())) for copy, row, rule, text in
             (match.groups() for match in matches) if copy in paths]  # fmt: skip
    style = (finding for finding in found if _RULES.match(finding.rule))
    return _most_of_each(style), _most_of_each(finding for finding in found if finding.rule == _COMPLEX)


def _most_of_each(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings, so many of each file that more would make no difference."""
    by_path: dict[str, list[Finding]] = defaultdict(list)
    for finding in findings:
        by_path[finding.path].append(finding)
    return [finding for found in by_path.values() for finding in found[:_MAX_FINDINGS]]


# One docstring is enough for a property and its setter, and for a function and its overloads.
_SAME_THING = ("setter", "deleter", "getter", "overload")
_MAX_DOCSTRING = 500
_MAX_VIOLATIONS = 5  # of one docstring


def public_definitions(module: Module) -> Iterator[Definition]:
    """Yield what is public in a module of the package, a launch file or a script: no leading _ on the way to it."""
    parts = PurePosixPath(module.path).with_suffix("").parts
    if module.role not in JUDGED or any(part.startswith("_") and part != "__init__" for part in parts):
        return
    if module.tree.body or module.stem != "__init__":
        words = _words(module.tree)
        yield Definition(module.path, 1, "module", module.name, bool(words), words=words)
    yield from _inside(module.path, module.tree.body, "")


def _inside(path: str, body: Sequence[ast.stmt], owner: str) -> Iterator[Definition]:
    for node in body:
        if isinstance(node, ast.If | ast.Try):
            yield from _inside(path, [*node.body, *node.orelse, *getattr(node, "finalbody", [])], owner)
        elif isinstance(node, ast.ClassDef | Function) and not node.name.startswith("_") and not _is_same(node):
            words = _words(node)
            name = f"{owner}{node.name}"
            if isinstance(node, ast.ClassDef):
                yield Definition(path, node.lineno, "class", name, bool(words), words=words)
                yield from _inside(path, node.body, f"{name}.")
            else:
                missing = _unannotated(node, is_method=bool(owner))
                yield Definition(path, node.lineno, "function", name, bool(words), unannotated=missing, words=words)


def with_violations(definitions: Sequence[Definition], copies: Mapping[str, str]) -> list[Definition]:
    """Return the definitions with what their docstrings violate of ament_pep257's rules.

    `copies` are the paths of the files' copies, by the files' own.
    """
    import pydocstyle
    from ament_pep257.main import _ament_ignore

    paths = {copy: path for path, copy in copies.items()}
    # pydocstyle gives a module and a definition on its first line the same line, as we do.
    found: dict[tuple[str, int], list[Finding]] = defaultdict(list)
    for error in pydocstyle.check(list(paths), ignore=_ament_ignore, ignore_inline_noqa=True):
        if isinstance(error, pydocstyle.violations.Error):  # anything else is a file that it cannot parse
            rule, _, text = error.message.partition(": ")
            path = paths[error.definition.module.name]
            found[path, error.definition.start].append(Finding(path, error.line, rule, printable(text)))
    return [replace(item, violations=found[item.path, item.line][:_MAX_VIOLATIONS]) for item in definitions]


def _words(node: ast.Module | ast.ClassDef | Function) -> str:
    return " ".join(re.findall(r"[^\W\d_]+", (ast.get_docstring(node) or "")[:_MAX_DOCSTRING].lower()))


def _is_same(node: ast.ClassDef | Function) -> bool:
    return any(last_name(decorator) in _SAME_THING for decorator in node.decorator_list)


def _unannotated(node: Function, *, is_method: bool) -> list[str]:
    """Return the names of the parameters without a type, and "return"."""
    given = node.args
    parameters = [*given.posonlyargs, *given.args]
    if is_method and not any(last_name(decorator) == "staticmethod" for decorator in node.decorator_list):
        parameters = parameters[1:]
    rest = [item for item in (given.vararg, given.kwarg) if item is not None]
    missing = [item.arg for item in (*parameters, *given.kwonlyargs, *rest) if item.annotation is None]
    return missing + (["return"] if node.returns is None else [])


BLOCK = 6  # lines, each with a statement of its own or the head of one
_MAX_PLACES = 20
_MAX_COPIES = 50


@dataclass(frozen=True)
class _Line:
    path: str
    first: int
    last: int
    code: str


def duplicated_blocks(modules: Sequence[Module]) -> list[Copy]:
    """Return the blocks of six or more lines that occur more than once, the longest first.

    Spaces, comments and line breaks make no difference. Imports, docstrings, tests and the end of every ROS node
    (`main` and the lines that call it) do not count.
    """
    runs = [list(_lines(module)) for module in modules if module.role in JUDGED]
    places: dict[tuple[str, ...], list[tuple[int, int]]] = defaultdict(list)
    for number, run in enumerate(runs):
        for start in range(len(run) - BLOCK + 1):
            places[_block(run, start)].append((number, start))
    found = []
    seen: set[tuple[int, int]] = set()
    for number, run in enumerate(runs):
        for start in range(len(run) - BLOCK + 1):
            here = (number, start)
            if here in seen:
                continue
            candidates = [place for place in places[_block(run, start)] if place > here and place not in seen]
            lengths = {place: _common(runs, here, place) for place in candidates[:_MAX_PLACES]}
            others = [place for place, length in lengths.items() if length >= BLOCK]
            if not others:
                continue
            length = min(lengths[place] for place in others)
            group = [here, *others]
            seen |= {(n, s + step) for n, s in group for step in range(length - BLOCK + 1)}
            found.append(Copy(length, [_place(runs[n][s : s + length]) for n, s in group[:5]]))
    return sorted(found, key=lambda copy: -copy.lines)[:_MAX_COPIES]


def copied_lines(originals: Iterable[Module], module: Module) -> int:
    """Return how many lines of a module stand in the originals, too, in blocks as `duplicated_blocks` compares them."""
    known = {block for original in originals for block in _blocks(list(_lines(original)))}
    blocks = _blocks(list(_lines(module)))
    return len({start + step for start, block in enumerate(blocks) if block in known for step in range(BLOCK)})


def _blocks(run: Sequence[_Line]) -> list[tuple[str, ...]]:
    return [_block(run, start) for start in range(len(run) - BLOCK + 1)]


def _block(run: Sequence[_Line], start: int) -> tuple[str, ...]:
    return tuple(line.code for line in run[start : start + BLOCK])


def _common(runs: Sequence[Sequence[_Line]], a: tuple[int, int], b: tuple[int, int]) -> int:
    """Return how many lines two places have in common; a block does not run into its own copy."""
    (run_a, start_a), (run_b, start_b) = a, b
    most = min(len(runs[run_a]) - start_a, len(runs[run_b]) - start_b)
    if run_a == run_b:
        most = min(most, start_b - start_a)
    length = 0
    while length < most and runs[run_a][start_a + length].code == runs[run_b][start_b + length].code:
        length += 1
    return length


def _place(lines: Sequence[_Line]) -> str:
    return f"{lines[0].path}:{lines[0].first}-{lines[-1].last}"


def _lines(module: Module) -> Iterator[_Line]:
    """Yield the module's code in order, a line for each simple statement and for each head of a compound one."""
    todo: list[ast.AST] = list(reversed(module.tree.body))
    while todo:
        node = todo.pop()
        if isinstance(node, ast.Import | ast.ImportFrom) or is_docstring(node) or _is_ending(node):
            continue
        inside = inner(node)
        first = getattr(node, "lineno", 0)
        last = getattr(node, "end_lineno", first) if not inside else first
        yield _Line(module.path, first, last, _code(node))
        todo += reversed(inside)


def _is_ending(node: ast.AST) -> bool:
    """Return whether this is `def main` or `if __name__ == '__main__'`."""
    if isinstance(node, Function):
        return node.name == "main"
    return isinstance(node, ast.If) and "__name__" in {last_name(part) for part in ast.walk(node.test)}


def _code(node: ast.AST) -> str:
    """Return a statement's structure as text; for a compound statement, only its head's."""
    parts = [type(node).__name__]
    for name, value in ast.iter_fields(node):
        if name not in (*BODIES, "type_comment"):
            for part in value if isinstance(value, list) else [value]:
                parts.append(ast.dump(part) if isinstance(part, ast.AST) else repr(part))
    return " ".join(parts)
