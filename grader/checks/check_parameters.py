"""Parameters from files, and values that make no sense, at start and at run time."""

from typing import Any

from grader.checks.first_cause import sentence
from grader.checks.judge import Judge, NotReached
from grader.words import mark, say

NEEDS = ("idle", "file", "senseless_settings", "senseless_start")
_TRY_CALLBACK = mark("register add_on_set_parameters_callback before you declare the parameters")


def test_parameter_files_load(judge: Judge) -> None:
    """The YAML files load on their nodes."""
    trials = [judge.trial(f"file_{node.name}") for node in judge.course.nodes.values() if node.config]
    missing = [
        f"{trial.node}: {answer.name}" for trial in trials for answer in trial.parameters if answer.value is None
    ]
    first = next((answer.name for trial in trials for answer in trial.parameters if answer.value is None), "")
    judge.expect(not missing, say("not declared: {missing}", missing=", ".join(missing)), _try_declare(judge, first))
    for trial in trials:
        for answer in trial.parameters:
            set_to = trial.in_files.get(answer.name, answer.value)
            seen = say(
                "{answer.name} was {set_to} in the file and {answer.value} in {trial.node}",
                answer=answer,
                set_to=set_to,
                trial=trial,
            )
            faults = [
                fault for fault in judge.faults("parameters") if fault.path == judge.course.nodes[trial.node].config
            ]
            if faults:
                judge.expect(answer.value == set_to, f"{sentence(faults[0])}\n{seen}", faults[0].cure)
            judge.expect(answer.value == set_to, seen, say("is the file's key the node's name, or /**?"))


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
                raise NotReached(
                    say("the node has no value of {parameter} to show: does it declare it?", parameter=parameter)
                )
            judge.expect(
                now != value,
                say("the node started with {parameter} = {now}", parameter=parameter, now=now),
                _TRY_CALLBACK,
            )


def _try_declare(judge: Judge, name: str) -> str:
    parameters = {n: p.default for node in judge.course.nodes.values() for n, p in node.parameters.items()}
    default = parameters.get(name, "its default")
    shown = repr(default) if name in parameters else default
    return say("self.declare_parameter('{name}', {shown}), and so every one of the contract", name=name, shown=shown)
