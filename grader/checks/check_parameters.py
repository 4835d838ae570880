"""Parameters from files, and values that make no sense, at start and at run time."""

from typing import Any

from grader.checks.first_cause import sentence
from grader.checks.judge import Failed, Judge, NotReached
from grader.evidence import ParameterAnswer
from grader.words import mark, say

NEEDS = ("idle", "file", "senseless_settings", "senseless_start")
_TRY_CALLBACK = mark("register add_on_set_parameters_callback before you declare the parameters")


def test_parameter_files_load(judge: Judge) -> None:
    """The YAML files load on their nodes."""
    nodes = [node for node in judge.course.nodes.values() if node.config]
    answers = [(node, answer) for node in nodes for answer in judge.trial(f"file_{node.name}").parameters]
    missing = [(f"{node.name}: {answer.name}", answer.name) for node, answer in answers if answer.value is None]
    if missing:
        seen = say("not declared: {missing}", missing=", ".join(words for words, _ in missing))
        raise Failed(seen, _try_declare(judge, missing[0][1]))
    for node, answer in answers:
        set_to = judge.trial(f"file_{node.name}").in_files.get(answer.name, answer.value)
        if answer.value != set_to:
            seen, try_ = differs(answer, set_to, node.name), say("is the file's key the node's name, or /**?")
            if fault := next((fault for fault in judge.faults("parameters") if fault.path == node.config), None):
                seen, try_ = f"{sentence(fault)}\n{seen}", fault.cure
            raise Failed(seen, try_)


def differs(answer: ParameterAnswer, set_to: Any, node: str) -> str:
    """Return in words that a parameter has another value than the file says."""
    words = mark("{answer.name} was {set_to} in the file and {answer.value} in {node}")
    return say(words, answer=answer, set_to=set_to, node=node)


def test_invalid_values_are_refused_at_run_time(judge: Judge) -> None:
    """A value that makes no sense (negative, zero rate) is refused by a parameter callback at run time."""
    asked, accepted = 0, []
    for node in [node for node in judge.course.nodes.values() if node.refused]:
        trial = judge.trial(f"senseless_settings_{node.name}")
        for answer in trial.parameters[:-1]:
            asked += 1
            if answer.accepted is not False or answer.value == answer.wanted:
                accepted.append(f"{answer.name} := {answer.wanted}")
        good = trial.parameters[-1]
        seen = say("{good.name} := {good.wanted}, which makes sense, was refused: {good.reason}", good=good)
        undeclared = "undeclared" in good.reason or "not declared" in good.reason
        try_ = _try_declare(judge, good.name) if undeclared else say("refuse only values that make no sense")
        judge.expect(good.accepted is True, seen, try_)
    if accepted:
        try_ = say("let the callback refuse, for every parameter, the values that make no sense")
        judge.share(1 - len(accepted) / asked, say("accepted: {accepted}", accepted=", ".join(accepted)), try_)


def test_invalid_values_are_refused_at_start(judge: Judge) -> None:
    """A value that makes no sense (negative, zero rate) is refused by a parameter callback at start."""
    for node in [node for node in judge.course.nodes.values() if node.refused]:
        ((parameter, value),) = node.refused_at_start.items()
        judge.trial(f"idle_{node.name}", complete=False)  # a node that never starts has refused nothing
        trial = judge.started(f"senseless_start_{node.name}")
        if trial.ready:
            now: Any = trial.parameters[0].value if trial.parameters else None
            if now is None and trial.process is not None and trial.process.by == "itself":
                continue  # it was on the graph for a moment and ended: that is a refusal
            if now is None:
                words = mark("the node has no value of {parameter} to show: does it declare it?")
                raise NotReached(say(words, parameter=parameter))
            seen = say("the node started with {parameter} = {now}", parameter=parameter, now=now)
            judge.expect(now != value, seen, _TRY_CALLBACK)


def _try_declare(judge: Judge, name: str) -> str:
    parameters = {n: p.default for node in judge.course.nodes.values() for n, p in node.parameters.items()}
    default = parameters.get(name, "its default")
    shown = repr(default) if name in parameters else default
    return say("self.declare_parameter('{name}', {shown}), and so every one of the contract", name=name, shown=shown)
