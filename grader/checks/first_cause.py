"""Say first what a program itself said, then what the graph and the package's text show, before anything guessed."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence

from grader import tracebacks
from grader.checks.wording import place, wrong_topics
from grader.course import Course
from grader.evidence import Fault, Finding, Kind, Reason, Trial
from grader.words import mark, say, some

OF_TRIALS = (Kind.RAISED, Kind.INACTIVE, Kind.NO_FLOAT, Kind.ON_GRAPH, Kind.SPINS)
"""What a trial shows that comes before what a check has seen."""
_SMALLEST = 1e-300  # rclpy reads an int as a float far below any speed, such as 5e-324
_CHANGE_STATE = "lifecycle_msgs/srv/ChangeState"

# By what a callback does that does not return, with what to do; what says more comes first.
_A_TIMER = mark("return at once and let a timer do the next step; where an answer is needed, `await` the future")
HOLDS_ON = {
    "loop-in-callback": _A_TIMER,
    "wait-in-callback": mark(
        "`await` call_async() in an `async def`; or give the client a callback group of its own, and the node a "
        "MultiThreadedExecutor"
    ),
    "sleep-in-callback": _A_TIMER,
}
# What launch says of a process that died, with its command, and the last line of that process's traceback.
_DIED, _COMMAND = "process has died", re.compile(r", cmd '.*'")
_INSTALLED = re.compile(r"/ws/install/share/[^/\s]{1,200}/(?=\S)")  # the place of a file is that in the package
_LAUNCH_ERROR = re.compile(r".*(?:\[(?:ERROR|FATAL)\]|process has died)|(?:\[[\w-]+\] )?[\w.]*(?:Error|Exception)\b")


def of_trials(trials: Sequence[Trial], course: Course, seen: str, graph: tuple[str, ...]) -> Reason | None:
    """Return what comes before what a check has `seen` in these trials, the latest first; None if nothing does.

    `graph` is the requirement that judges what the graph shows.
    """
    # What a node said that ended by itself is already in what the check has seen.
    said = (what_it_said(trial) for trial in trials if trial.process is not None and trial.process.by == "us")
    shown = (reason for trial in trials for reason in _shown_by_graph(trial, course, graph, seen))
    topics = ", ".join(dict.fromkeys(topic for trial in trials for topic in trial.deaf_to))
    unheard = Reason(Kind.UNHEARD, said=topics, requirements=graph) if topics else None
    causes = (why for why in (*said, *shown, unheard) if why is not None)
    return next((why for why in causes if not why.said or why.said not in seen), None)


def what_it_said(trial: Trial) -> Reason | None:
    """Return the last exception that a trial's node wrote down, with its place; None if there is none."""
    said, place = tracebacks.raised(trial.process.output_tail if trial.process is not None else "")
    return Reason(Kind.RAISED, said=said, place=place) if said else None


def _shown_by_graph(trial: Trial, course: Course, graph: tuple[str, ...], seen: str) -> Iterator[Reason]:
    """Yield why nothing of what a node publishes arrives, or why it hears nothing."""
    node = course.nodes[trial.node]
    if any(0.0 < abs(n) < _SMALLEST for command in trial.commands for n in (command.v, command.omega)):
        yield Reason(Kind.NO_FLOAT, node.command)
    if trial.graph is None or trial.launch:
        return
    heard = {message.topic for message in trial.messages} | ({node.command} if trial.commands else set())
    silent = {topic for topic in node.publishes if topic not in heard and (topic == node.command or topic in seen)}
    if silent and any(_CHANGE_STATE in types for types in trial.graph.services.values()):
        yield Reason(Kind.INACTIVE, node.name)
    for topic, words, instead in wrong_topics(course, trial.graph, node):
        if instead and (topic in silent or topic in node.subscribes):
            yield Reason(Kind.ON_GRAPH, topic, said=words, requirements=graph)


def spinning(
    trials: Sequence[Trial], habits: Sequence[Finding], of_node: Mapping[str, frozenset[str]]
) -> Reason | None:
    """Return which callback of a node of these trials spins, which takes its executor from it; None if none does.

    Only of trials in which something was asked of the node: which callbacks ran is not known.
    """
    trials = [trial for trial in trials if trial.goals or trial.calls]
    own = {path for trial in trials for path in of_node.get(trial.node, ())}
    return _spin([habit for habit in habits if habit.path in own or not own]) if trials else None


def _spin(habits: Sequence[Finding]) -> Reason | None:
    spins = (habit for habit in habits if habit.rule == "spin-in-callback")
    return next((Reason(Kind.SPINS, said=habit.text, place=place(habit)) for habit in spins), None)


def last_output(trial: Trial) -> str:
    """Return words with the last output of a node that ended by itself, and its place; "" for any other node."""
    if trial.process is None or trial.process.by != "itself":
        return ""
    said = tracebacks.last_words(trial.process.output_tail)
    return say("; its last output was: {said}", said=said) if said else ""


def sentence(fault: Fault) -> str:
    """Return where a fault is and what it is: "CMakeLists.txt:10: it names `srv/SetSped.srv`, which is not there"."""
    return f"{fault.path}{f':{fault.line}' if fault.line else ''}: {fault.text}"


def with_cure(fault: Fault) -> str:
    """Return a fault's sentence, and what to do about it in brackets."""
    return f"{sentence(fault)} ({fault.cure})"


def shown_by(faults: Sequence[Fault], output: str) -> Fault | None:
    """Return the first fault that the output of a build or of a node shows, by its words or its place; None if none."""
    for fault in faults:
        place = [rf'{re.escape(fault.path)}(?::|", line ){fault.line}'] if fault.line else []
        if any(re.search(rf"(?<!\w)(?:{words})(?!\w)", output) for words in [*map(re.escape, fault.shown_as), *place]):
            return fault
    return None


def behind(faults: Sequence[Fault], missing: Collection[str]) -> Fault | None:
    """Return the first fault because of which one of the `missing` programs and files is not there, None if none is."""
    return next((fault for fault in faults if not set(missing).isdisjoint(fault.lacks)), None)


def listing(faults: Sequence[Fault], lead: str) -> str:
    """Return the faults as lines below `lead`, each with its cure; "" if there are none."""
    lines = [f"\n  {with_cure(fault)}" for fault in faults]
    return lead + some(lines, between="") if lines else ""


def besides(faults: Sequence[Fault]) -> str:
    """Return the first faults as the end of a sentence, "" if there are none."""
    shown = "; ".join(map(with_cure, faults[:3]))
    return say("; the package's text shows: {shown}", shown=shown) if shown else ""


def holding_on(habits: Sequence[Finding]) -> str:
    """Return as the end of a sentence which lines of a package keep a callback from returning, "" if none does."""
    if spin := _spin(habits):
        return f"; {spin}"
    places = ", ".join(f"{place(habit)} {habit.text}" for habit in holds_on(habits))
    return say("; while a callback runs the node answers nothing: {places}", places=places) if places else ""


def holds_on(habits: Sequence[Finding], where: str = "") -> list[Finding]:
    """Return the lines that keep a callback from returning: that at `where` alone, or else the first two."""
    found = [habit for rule in HOLDS_ON for habit in habits if habit.rule == rule]
    there = [habit for habit in found if re.match(rf"{re.escape(place(habit))}(?!\d)", where)]
    return there[:1] or found[:2]


def launch_errors(trial: Trial) -> str:
    """Return as the end of a sentence the errors that `ros2 launch` printed, "" if it printed none."""
    output = trial.process.output_tail if trial.process is not None else ""
    said, place = tracebacks.raised(output)
    errors = (line.strip() for line in output.splitlines() if _LAUNCH_ERROR.match(line))
    lines = [_COMMAND.sub("", _INSTALLED.sub("", line)) for line in errors]
    lines = [f"{line} ({place})" if place and said in line else line for line in lines]
    first = sorted(lines, key=lambda line: (_DIED in line, said not in line))[:3]  # what a node said comes first
    return say("; `ros2 launch` said: {errors}", errors=" | ".join(first)[:600]) if first else ""


def its_name(trial: Trial, nodes: Collection[str]) -> str:
    """Return as the end of a sentence which other nodes came up instead of the trial's, "" if none did."""
    others = sorted({name.rpartition("/")[2] for name in trial.graph.nodes} - {*nodes}) if trial.graph else []
    others = [f"`{name}`" for name in others if not name.startswith("launch_ros")]
    named = f"super().__init__('{trial.node}')"
    if trial.launch:
        named = say("name= in the launch file, the key in the YAML file and the node's own name have to be the same")
    return say("; is {others} its name? {named}", others=" or ".join(others[:2]), named=named) if others else ""
