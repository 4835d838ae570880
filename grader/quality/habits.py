"""Bad habits: a bare except, print, a mutable default, sleeping in a callback; and what explains a node that is silent.

The first three are not left to plugins of flake8: installed beside ament_flake8 these would report in the student's
own runs of it, too, and Q1 promises that those agree with the grader.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from grader.evidence import Finding
from grader.python_ast import Function, called, last_name
from grader.quality.parsed_module import CallGraph, Module, imports, own_body

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
