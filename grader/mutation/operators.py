"""The faults: a small set of mistakes that people make in a robot's nodes. Source in, changes out; nothing is run."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from grader.mutation.source_text import Change, Source, Spot
from grader.python_ast import TOO_COMPLEX, Function, called, is_docstring

Operator = Callable[[Source, Spot], Iterator[Change]]

_OPPOSITE: dict[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", ">="), ast.LtE: ("<=", ">"), ast.Gt: (">", "<="), ast.GtE: (">=", "<"), ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"), ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}  # fmt: skip
_ARITHMETIC: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
}  # fmt: skip
_SWAPPED = {"min": "max", "max": "min", "sin": "cos", "cos": "sin"}
_UNIT_CALLS = {"radians", "degrees", "deg2rad", "rad2deg"}
_UNIT_FACTORS = {100, 1000, 180, 360, 1e9, 1e-9, 1e6, 1e-3}
_CREATES = {
    "create_publisher", "create_subscription", "create_service", "create_client", "create_timer", "ActionServer",
    "ActionClient", "QoSProfile",
}  # fmt: skip
# How many threads there are and how long one waits for another changes when a thing is done, not what.
_WAITS = {
    "MultiThreadedExecutor", "spin_once", "spin_until_future_complete", "wait", "join", "wait_for_server",
    "wait_for_service",
}  # fmt: skip
_NAMED = _CREATES - {"create_timer", "QoSProfile"}
# The contract's names and words, wherever the code holds them.
_WORDS = {
    "scan", "odom", "cmd_vel", "set_speed", "get_status", "navigate_to_position", "raw_scan", "imu/data",
    "battery/state", "sensor_fusion_data", "obstacle_distance", "base_link", "ACTIVE", "OBSTACLE_DETECTED",
    "robot_controller", "sensor_processor",
}  # fmt: skip
# The contract's parameters and their defaults: a node that ignores a parameter goes by its default.
PARAMETERS: Mapping[str, float] = {
    "max_linear_speed": 0.5, "max_angular_speed": 1.0, "linear_acceleration": 1.0, "angular_acceleration": 2.0,
    "laser_processing_rate": 10.0, "fusion_rate": 20.0, "obstacle_detection_threshold": 0.5,
    "emergency_stop_distance": 0.2, "safety_margin": 0.3, "fusion_frequency": 20.0, "battery_low_threshold": 20.0,
    "battery_critical_threshold": 10.0,
}  # fmt: skip
_DEEDS = re.compile(r"publish|feedback|^_?stop|brake|halt|^succeed$|^abort$|^canceled$|^cancel$|set_result")
_CALLBACK = re.compile(r"callback|^_?on_|_cb$|^_?handle_")
_QOS = {
    "BEST_EFFORT": "RELIABLE", "RELIABLE": "BEST_EFFORT", "VOLATILE": "TRANSIENT_LOCAL", "TRANSIENT_LOCAL": "VOLATILE",
}  # fmt: skip


def mutants(source: Source) -> list[Change]:
    """Return every fault that could be put into a source, in its order; none for one that is too much for Python."""
    try:
        return _faults(source)
    except TOO_COMPLEX:
        return []


def _faults(source: Source) -> list[Change]:
    callbacks = _callbacks(source.tree)
    found = []
    for spot in source.spots():
        for operator in OPERATORS:
            found += [change for change in operator(source, spot) if source.changes(change)]
        if isinstance(spot.node, Function) and (spot.node.name in callbacks or _CALLBACK.search(spot.node.name)):
            found += [change for change in _empty_callback(source, spot) if source.changes(change)]
    return found


def compare(source: Source, spot: Spot) -> Iterator[Change]:
    """A comparison turned round."""
    node = spot.node
    if not isinstance(node, ast.Compare):
        return
    left = node.left
    for operator, right in zip(node.ops, node.comparators, strict=True):
        old, new = _OPPOSITE[type(operator)]
        yield from _between(source, spot, left, right, old, new, "comparison")
        left = right


def arithmetic(source: Source, spot: Spot) -> Iterator[Change]:
    """A sign or an operation turned round."""
    node = spot.node
    if (
        isinstance(node, ast.BinOp)
        and type(node.op) in _ARITHMETIC
        and not (_is_text(node.left) or _is_text(node.right))
    ):
        if isinstance(node.op, ast.Mult | ast.Div) and (_is_unit(node.left) or _is_unit(node.right)):
            return
        yield from _between(source, spot, node.left, node.right, *_ARITHMETIC[type(node.op)], "sign")
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and _number(node.operand) != 0:
        operand = source.text_of(node.operand)
        yield source.change(spot, "sign", f"`{source.text_of(node)}` became `{operand}`", operand)


def logic(source: Source, spot: Spot) -> Iterator[Change]:
    """And for or, a not forgotten."""
    node = spot.node
    if isinstance(node, ast.BoolOp):
        words = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        yield from _between(source, spot, node.values[0], node.values[1], *words, "condition")
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        operand = source.text_of(node.operand)
        yield source.change(spot, "condition", f"`{source.text_of(node)}` became `{operand}`", f"({operand})")


def condition(source: Source, spot: Spot) -> Iterator[Change]:
    """A condition that always holds, or never."""
    node = spot.node
    if isinstance(spot.parent, ast.If | ast.IfExp) and node is spot.parent.test:
        text = _short(source.text_of(node))
        yield source.change(spot, "condition", f"the condition `{text}` became always true", "True")
        yield source.change(spot, "condition", f"the condition `{text}` became always false", "False")


def constant(source: Source, spot: Spot) -> Iterator[Change]:
    """A number changed, or a True for a False."""
    node = spot.node
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        if isinstance(spot.parent, ast.Assign | ast.Return | ast.keyword | ast.AnnAssign):
            yield source.change(spot, "constant", f"`{node.value}` became `{not node.value}`", str(not node.value))
        return
    text = source.text_of(node) if isinstance(node, ast.Attribute | ast.Constant) else ""
    if isinstance(spot.parent, ast.UnaryOp):
        return  # the sign is turned round instead
    if text == "math.inf":
        yield source.change(spot, "constant", "`math.inf` became `0.0`", "0.0")
    elif text in ("math.pi", "math.tau"):
        yield source.change(spot, "constant", f"`{text}` became `{text} / 2`", f"({text} / 2)")
    value = _number(node)
    if value is None or not _is_telling(spot, value):
        return
    new = repr(2 * value if value else value + 1)
    yield source.change(spot, "constant", f"`{text}` became `{new}`", new)


def unit(source: Source, spot: Spot) -> Iterator[Change]:
    """A unit not converted: degrees for radians, a ratio for percent, nanoseconds for seconds."""
    node = spot.node
    if isinstance(node, ast.Call) and called(node) in _UNIT_CALLS and len(node.args) == 1:
        inner = source.text_of(node.args[0])
        yield source.change(spot, "unit", f"`{_short(source.text_of(node))}` became `{_short(inner)}`", f"({inner})")
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        factor, other = (node.right, node.left) if _is_unit(node.right) else (node.left, node.right)
        if _is_unit(factor) and (factor is node.right or isinstance(node.op, ast.Mult)):
            inner = source.text_of(other)
            words = f"`{_short(source.text_of(node))}` became `{_short(inner)}`"
            yield source.change(spot, "unit", words, f"({inner})")


def function(source: Source, spot: Spot) -> Iterator[Change]:
    """The other one of a pair of functions, or a size taken with its sign."""
    node = spot.node
    if not isinstance(node, ast.Call):
        return
    name = called(node)
    if name in _SWAPPED:
        where = _last(source, node.func, name)
        yield source.change(spot, "function", f"`{name}` became `{_SWAPPED[name]}`", _SWAPPED[name], where)
    if name == "abs" and len(node.args) == 1:
        inner = source.text_of(node.args[0])
        yield source.change(
            spot, "function", f"`{_short(source.text_of(node))}` became `{_short(inner)}`", f"({inner})"
        )


def parameter(source: Source, spot: Spot) -> Iterator[Change]:
    """A parameter ignored: the default stands where its value was asked for."""
    node = spot.node
    if isinstance(spot.parent, ast.Attribute):
        return  # the whole chain get_parameter('x').value is looked at from above
    name = _parameter_read(node)
    if name in PARAMETERS:
        new = repr(PARAMETERS[name])
        yield source.change(spot, "parameter", f"the parameter {name} is ignored, {new} stands in its place", new)


def left_out(source: Source, spot: Spot) -> Iterator[Change]:
    """A publish, a stop, a feedback or the setting of a field left out."""
    node = spot.node
    if isinstance(node, ast.Expr) and _DEEDS.search(called(node.value)):
        kind = "feedback" if "feedback" in called(node.value) else "call"
        yield _without(source, spot, kind, f"the call `{_short(source.text_of(node))}` was left out")
    if isinstance(node, ast.Assign | ast.AugAssign):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        around = spot.function_node
        if around is None or around.name == "__init__" or not all(isinstance(t, ast.Attribute) for t in targets):
            return
        yield _without(source, spot, "assignment", f"`{_short(source.text_of(node))}` was left out")


def names(source: Source, spot: Spot) -> Iterator[Change]:
    """Another name of a topic, a service, an action, a frame or a status; another quality of service."""
    node = spot.node
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        within = called(spot.parent) in _NAMED or any(called(p) == "__init__" for p in spot.parents[-1:])
        if node.value.lstrip("/") in _WORDS or (within and re.fullmatch(r"[\w/~]+", node.value)):
            text = source.text_of(node)
            new = f"{text[:-1]}2{text[-1]}"
            yield source.change(spot, "name", f"the name {text} became {new}", new)
    if (
        isinstance(node, ast.Name | ast.Attribute)
        and isinstance(spot.parent, ast.Call)
        and node is not spot.parent.func
    ):
        text = source.text_of(node)
        if text.rpartition(".")[2] == "qos_profile_sensor_data":
            yield source.change(spot, "qos", f"the quality of service `{text}` became `10` (reliable)", "10")
    if isinstance(node, ast.Attribute) and node.attr in _QOS:
        new, where = _QOS[node.attr], _last(source, node, node.attr)
        yield source.change(spot, "qos", f"the quality of service `{node.attr}` became `{new}`", new, where)


OPERATORS: Sequence[Operator] = (
    compare, arithmetic, logic, condition, constant, unit, function, parameter, left_out, names,
)  # fmt: skip


def _empty_callback(source: Source, spot: Spot) -> Iterator[Change]:
    """A callback that does nothing; a service's still answers."""
    node = spot.node
    assert isinstance(node, Function)
    body = node.body[1:] if is_docstring(node.body[0]) else node.body
    plain = [argument.arg for argument in node.args.args if argument.arg != "self"]
    if not body or (len(body) == 1 and isinstance(body[0], ast.Return | ast.Pass)):
        return
    returns = [ast.unparse(n.value) for n in ast.walk(node) if isinstance(n, ast.Return) and n.value]
    if returns and not (len(plain) == 2 and set(returns) == {plain[1]}):
        return
    new = f"return {plain[1]}" if returns else "pass"
    start, end = source.span(body[0])[0], source.span(body[-1])[1]
    new += "\n" * source.piece(start, end).count("\n")
    inner = Spot(body[0], (*spot.parents, node), body[0], spot.function)
    yield source.change(inner, "callback", f"the body of `{node.name}` was left out", new, (start, end))


def _callbacks(tree: ast.Module) -> set[str]:
    """Return the names of the methods that are handed to something that calls back."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and (called(node) in _CREATES or "callback" in called(node)):
            arguments = [*node.args, *(keyword.value for keyword in node.keywords)]
            found |= {a.attr for a in arguments if isinstance(a, ast.Attribute)}
    return found


def _between(
    source: Source, spot: Spot, left: ast.AST, right: ast.AST, old: str, new: str, operator: str
) -> Iterator[Change]:
    """Yield the change of the operator that stands between two operands."""
    start, end = source.span(left)[1], source.span(right)[0]
    pattern = r"\s+".join(rf"\b{word}\b" if word.isalpha() else re.escape(word) for word in old.split())
    found = re.search(pattern, source.piece(start, end))
    if found and "#" not in source.piece(start, end):
        where = (start + found.start(), start + found.end())
        text = _short(source.piece(source.span(left)[0], source.span(right)[1]))
        yield source.change(spot, operator, f"`{old}` became `{new}` in `{text}`", new, where)


def _last(source: Source, node: ast.AST, name: str) -> tuple[int, int]:
    """Return where the name at the end of `a.b.name` stands."""
    end = source.span(node)[1]
    return end - len(name.encode()), end


def _without(source: Source, spot: Spot, operator: str, words: str) -> Change:
    new = "pass" + "\n" * source.text_of(spot.node).count("\n")
    return source.change(spot, operator, words, new)


def _parameter_read(node: ast.AST) -> str:
    """Return the parameter whose value an expression reads, "" if it reads none.

    Known forms: x.get_parameter('n').value, x.get_parameter('n').get_parameter_value().double_value, and a helper of
    the package's own that is given the name: self._value('n').
    """
    inner = node
    while isinstance(inner, ast.Attribute | ast.Call) and not _names_parameter(inner):
        inner = inner.value if isinstance(inner, ast.Attribute) else inner.func
    if not isinstance(inner, ast.Call) or not _names_parameter(inner):
        return ""
    argument = inner.args[0]
    assert isinstance(argument, ast.Constant)
    if called(inner) == "get_parameter":
        return str(argument.value) if inner is not node and isinstance(node, ast.Attribute) else ""
    helper = (
        inner is node and re.search(r"value|param|get", called(inner)) and not re.search(r"declare|set", called(inner))
    )
    return str(argument.value) if helper else ""


def _names_parameter(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Call)
        and len(node.args) == 1
        and isinstance(node.args[0], ast.Constant)
        and node.args[0].value in PARAMETERS
    )


def _number(node: ast.AST) -> int | float | None:
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return node.value  # type: ignore[return-value]
    return None


def _is_telling(spot: Spot, value: float) -> bool:
    """Return whether another number here would be another behaviour: no slack, no queue length, no digits to show."""
    if (value and abs(value) < 1e-3) or abs(value) >= 1e5:
        return False
    if isinstance(spot.parent, ast.Call):
        if called(spot.parent) in (_CREATES - {"create_timer"}) | _WAITS:
            return False
        if called(spot.parent) in ("round", "format") and spot.node is not spot.parent.args[0]:
            return False
    if isinstance(spot.parent, ast.BinOp) and isinstance(spot.parent.op, ast.Mult | ast.Div):
        return not (_is_unit(spot.node) and value in (100, 1000, 180, 360))
    return True


def _is_unit(node: ast.AST) -> bool:
    return _number(node) in _UNIT_FACTORS


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."
