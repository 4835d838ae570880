"""Mutation operators: mistakes that people make in a robot's nodes. Source in, changes out; nothing is run."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial

from grader.course import Course
from grader.mutation.source_text import Change, SourceText, Spot, shorten
from grader.python_ast import TOO_COMPLEX, Function, called, is_docstring, last_name

Operator = Callable[[SourceText, Spot], Iterator[Change]]

# How an operator is written, what is written instead, and the kind of that mistake.
_SWAPS: dict[type[ast.AST], tuple[str, str, str]] = {
    ast.Lt: ("<", ">=", "comparison"), ast.LtE: ("<=", ">", "comparison"),
    ast.Gt: (">", "<=", "comparison"), ast.GtE: (">=", "<", "comparison"),
    ast.Eq: ("==", "!=", "comparison"), ast.NotEq: ("!=", "==", "comparison"),
    ast.Is: ("is", "is not", "comparison"), ast.IsNot: ("is not", "is", "comparison"),
    ast.In: ("in", "not in", "comparison"), ast.NotIn: ("not in", "in", "comparison"),
    ast.Add: ("+", "-", "sign"), ast.Sub: ("-", "+", "sign"), ast.Mult: ("*", "/", "sign"), ast.Div: ("/", "*", "sign"),
    ast.And: ("and", "or", "condition"), ast.Or: ("or", "and", "condition"),
}  # fmt: skip
_PAIRS = {"min": "max", "max": "min", "sin": "cos", "cos": "sin"}
_UNIT_CALLS = {"radians", "degrees", "deg2rad", "rad2deg"}
_UNIT_FACTORS = {100, 1000, 180, 360, 1e9, 1e-9, 1e6, 1e-3}
_CREATES = {
    "create_publisher", "create_subscription", "create_service", "create_client", "create_timer", "ActionServer",
    "ActionClient", "QoSProfile",
}  # fmt: skip
# The number of threads and how long one waits for another change when a thing is done, not what is done.
_WAITS = {
    "MultiThreadedExecutor", "spin_once", "spin_until_future_complete", "wait", "join", "wait_for_server",
    "wait_for_service",
}  # fmt: skip
_NAMED = _CREATES - {"create_timer", "QoSProfile"}
_EFFECTS = re.compile(r"publish|feedback|^_?stop|brake|halt|^succeed$|^abort$|^canceled$|^cancel$|set_result")
_CALLBACK = re.compile(r"callback|^_?on_|_cb$|^_?handle_")
_QOS = {
    "BEST_EFFORT": "RELIABLE", "RELIABLE": "BEST_EFFORT", "VOLATILE": "TRANSIENT_LOCAL", "TRANSIENT_LOCAL": "VOLATILE",
}  # fmt: skip


def mutants(source: SourceText, course: Course) -> list[Change]:
    """Return every mutant of a source, in its order; [] for a source that is too complex for Python."""
    # A node that ignores a parameter uses its default.
    defaults = {name: value for node in course.nodes.values() for name, value in node.defaults.items()}
    # The contract's names and words are changed wherever they are in the code.
    words = {*course.topics, *course.words, *course.nodes}
    try:
        operators: tuple[Operator, ...] = (
            swap, negate, condition, constant, unit, function, partial(parameter, defaults=defaults), left_out,
            partial(names, words_of_contract=words), partial(empty_callback, callbacks=_callbacks(source.tree)),
        )  # fmt: skip
        return [change for spot in source.spots() for operator in operators for change in operator(source, spot)]
    except TOO_COMPLEX:
        return []


def swap(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Reverse a comparison or an arithmetic operation, or swap `and` and `or`."""
    places: list[tuple[ast.expr, ast.expr, ast.AST]]
    match spot.node:
        case ast.Compare(left=first, ops=ops, comparators=others):
            places = list(zip([first, *others], others, ops, strict=False))
        case ast.BinOp(left=left, op=op, right=right):
            is_conversion = isinstance(op, ast.Mult | ast.Div) and (_is_unit(left) or _is_unit(right))
            places = [] if is_conversion or _is_text(left) or _is_text(right) else [(left, right, op)]
        case ast.BoolOp(op=op, values=[left, right, *_]):
            places = [(left, right, op)]
        case _:
            places = []
    for before, after, found in places:
        if type(found) in _SWAPS:
            yield from _between(source, spot, before, after, *_SWAPS[type(found)])


def negate(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Forget a minus or a `not`."""
    match spot.node:
        case ast.UnaryOp(op=ast.USub(), operand=operand) if _number(operand) != 0:
            text = source.text_of(operand)
            yield source.change(spot, "sign", f"`{source.text_of(spot.node)}` became `{text}`", text)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield _reduced(source, spot, "condition", operand)


def condition(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Make a condition always true, or always false."""
    if isinstance(spot.parent, ast.If | ast.IfExp) and spot.node is spot.parent.test:
        text = source.short_text_of(spot.node)
        for value in ("True", "False"):
            if text != value:
                words = f"the condition `{text}` became always {value.lower()}"
                yield source.change(spot, "condition", words, value)


def constant(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Change a number, or swap True and False."""
    node = spot.node
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        if isinstance(spot.parent, ast.Assign | ast.Return | ast.keyword | ast.AnnAssign):
            yield source.change(spot, "constant", f"`{node.value}` became `{not node.value}`", str(not node.value))
        return
    text = source.text_of(node) if isinstance(node, ast.Attribute | ast.Constant) else ""
    if isinstance(spot.parent, ast.UnaryOp):
        return  # `arithmetic` reverses the sign instead
    if text == "math.inf":
        yield source.change(spot, "constant", "`math.inf` became `0.0`", "0.0")
    elif text in ("math.pi", "math.tau"):
        yield source.change(spot, "constant", f"`{text}` became `{text} / 2`", f"({text} / 2)")
    value = _number(node)
    if value is None or not _is_telling(spot, value):
        return
    new = repr(2 * value if value else value + 1)
    yield source.change(spot, "constant", f"`{text}` became `{new}`", new)


def unit(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Skip the conversion of a unit: degrees for radians, a ratio for percent, nanoseconds for seconds."""
    node = spot.node
    if isinstance(node, ast.Call) and called(node) in _UNIT_CALLS and len(node.args) == 1:
        yield _reduced(source, spot, "unit", node.args[0])
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        factor, other = (node.right, node.left) if _is_unit(node.right) else (node.left, node.right)
        if _is_unit(factor) and (factor is node.right or isinstance(node.op, ast.Mult)):
            yield _reduced(source, spot, "unit", other)


def function(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Call the other one of a pair of functions, or keep the sign where `abs` drops it."""
    node = spot.node
    if not isinstance(node, ast.Call):
        return
    name = called(node)
    if name in _PAIRS:
        where = _last(source, node.func, name)
        yield source.change(spot, "function", f"`{name}` became `{_PAIRS[name]}`", _PAIRS[name], where)
    if name == "abs" and len(node.args) == 1:
        yield _reduced(source, spot, "function", node.args[0])


def parameter(source: SourceText, spot: Spot, defaults: Mapping[str, float]) -> Iterator[Change]:
    """Ignore a parameter: use its default instead of its value."""
    node = spot.node
    if isinstance(spot.parent, ast.Attribute):
        return  # the whole chain get_parameter('x').value is handled at its outermost node
    name = _parameter_read(node, defaults)
    if name in defaults:
        new = repr(defaults[name])
        yield source.change(spot, "parameter", f"the parameter {name} was ignored, its default {new} used", new)


def left_out(source: SourceText, spot: Spot) -> Iterator[Change]:
    """Leave out a publish, a stop, a feedback or an assignment to a field."""
    node = spot.node
    if isinstance(node, ast.Expr) and _EFFECTS.search(called(node.value)):
        kind = "feedback" if "feedback" in called(node.value) else "call"
        yield _without(source, spot, kind, f"the call `{source.short_text_of(node)}` was left out")
    if isinstance(node, ast.Assign | ast.AugAssign):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        around = spot.function_node
        if around is None or around.name == "__init__" or not all(isinstance(t, ast.Attribute) for t in targets):
            return
        yield _without(source, spot, "assignment", f"`{source.short_text_of(node)}` was left out")


def names(source: SourceText, spot: Spot, words_of_contract: Collection[str]) -> Iterator[Change]:
    """Change the name of a topic, service, action, frame or status, or a quality of service."""
    node = spot.node
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        within = called(spot.parent) in _NAMED or any(called(p) == "__init__" for p in spot.parents[-1:])
        if node.value.lstrip("/") in words_of_contract or (within and re.fullmatch(r"[\w/~]+", node.value)):
            text = source.text_of(node)
            new = f"{text[:-1]}2{text[-1]}"
            yield source.change(spot, "name", f"the name {text} became {new}", new)
    if last_name(node) == "qos_profile_sensor_data" and isinstance(spot.parent, ast.Call):
        words = f"the quality of service `{source.text_of(node)}` became `10` (reliable)"
        yield source.change(spot, "qos", words, "10")
    if isinstance(node, ast.Attribute) and node.attr in _QOS:
        new, where = _QOS[node.attr], _last(source, node, node.attr)
        yield source.change(spot, "qos", f"the quality of service `{node.attr}` became `{new}`", new, where)


def empty_callback(source: SourceText, spot: Spot, callbacks: Collection[str]) -> Iterator[Change]:
    """Empty a callback; a service's callback still returns its response."""
    node = spot.node
    if not isinstance(node, Function) or not (node.name in callbacks or _CALLBACK.search(node.name)):
        return
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
    """Return the names of the methods that are passed as callbacks."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and (called(node) in _CREATES or "callback" in called(node)):
            arguments = [*node.args, *(keyword.value for keyword in node.keywords)]
            found |= {a.attr for a in arguments if isinstance(a, ast.Attribute)}
    return found


def _between(
    source: SourceText, spot: Spot, left: ast.AST, right: ast.AST, old: str, new: str, operator: str
) -> Iterator[Change]:
    """Yield the change of the operator between two operands."""
    start, end = source.span(left)[1], source.span(right)[0]
    pattern = r"\s+".join(rf"\b{word}\b" if word.isalpha() else re.escape(word) for word in old.split())
    found = re.search(pattern, source.piece(start, end))
    if found and "#" not in source.piece(start, end):
        where = (start + found.start(), start + found.end())
        text = shorten(source.piece(source.span(left)[0], source.span(right)[1]))
        yield source.change(spot, operator, f"`{old}` became `{new}` in `{text}`", new, where)


def _reduced(source: SourceText, spot: Spot, operator: str, part: ast.AST) -> Change:
    """Return the change of an expression to a part of it."""
    words = f"`{source.short_text_of(spot.node)}` became `{source.short_text_of(part)}`"
    return source.change(spot, operator, words, f"({source.text_of(part)})")


def _last(source: SourceText, node: ast.AST, name: str) -> tuple[int, int]:
    """Return where `name` is in `a.b.name`, in bytes."""
    end = source.span(node)[1]
    return end - len(name.encode()), end


def _without(source: SourceText, spot: Spot, operator: str, words: str) -> Change:
    new = "pass" + "\n" * source.text_of(spot.node).count("\n")
    return source.change(spot, operator, words, new)


def _parameter_read(node: ast.AST, parameters: Collection[str]) -> str:
    """Return the parameter whose value an expression reads, "" if it reads none.

    Known forms: x.get_parameter('n').value, x.get_parameter('n').get_parameter_value().double_value, and a call of
    one of the package's own helpers with the name: self._value('n').
    """
    inner = node
    while isinstance(inner, ast.Attribute | ast.Call) and not _names_parameter(inner, parameters):
        inner = inner.value if isinstance(inner, ast.Attribute) else inner.func
    if not isinstance(inner, ast.Call) or not _names_parameter(inner, parameters):
        return ""
    argument = inner.args[0]
    assert isinstance(argument, ast.Constant)
    if called(inner) == "get_parameter":
        return str(argument.value) if inner is not node and isinstance(node, ast.Attribute) else ""
    helper = (
        inner is node and re.search(r"value|param|get", called(inner)) and not re.search(r"declare|set", called(inner))
    )
    return str(argument.value) if helper else ""


def _names_parameter(node: ast.AST, parameters: Collection[str]) -> bool:
    return (
        isinstance(node, ast.Call)
        and len(node.args) == 1
        and isinstance(node.args[0], ast.Constant)
        and node.args[0].value in parameters
    )


def _number(node: ast.AST) -> int | float | None:
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return node.value  # type: ignore[return-value]
    return None


def _is_telling(spot: Spot, value: float) -> bool:
    """Return whether another number here changes behaviour: not a tolerance, a queue length or a number of digits."""
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
