"""Put into words that teach: findings with the reason for their rule, and a running graph against the contract."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence

from grader.course import Course, Node
from grader.evidence import Finding, Graph
from grader.words import MOST_SHOWN, mark, say

_PLACES = 3

# The reasons for the rules that students meet most. The longest matching prefix of a rule's name is used.
WHY = {
    "E1": mark("indentation is Python's structure, so it should look the same everywhere"),
    "E2": mark("even spaces let the eye find operators and arguments"),
    "E3": mark("blank lines are the paragraphs of code: two between definitions, one inside a class"),
    "E4": mark("imports at the top show at a glance what a module depends on"),
    "E5": mark("a line over 99 columns is cut off when two versions are shown side by side"),
    "E7": mark("with one statement on each line, a debugger can stop at each and a diff can show each"),
    "E711": mark("`is None` asks for None itself; `==` may be answered by any class"),
    "E722": mark("a bare `except` also catches Ctrl-C and your own typing errors"),
    "E731": mark("a `def` has a name in a traceback, a lambda has none"),
    "E9": mark("Python cannot read this file"),
    "W1": mark("a mix of tabs and spaces looks right in one editor and wrong in another"),
    "W2": mark("spaces at the end of a line are invisible and show up in every diff"),
    "W3": mark("a file that ends without a line break, or with several, shows up in diffs"),
    "F40": mark("an unused import makes readers look for its use"),
    "F50": mark("the format string and its values do not match"),
    "F52": mark("the format string and its values do not match"),
    "F82": mark("an undefined name fails only when the line runs, perhaps just before the wall"),
    "F811": mark("of two definitions with one name only the last counts: is one left over, or is its name wrong?"),
    "F841": mark("an unused value is either left over or a forgotten step"),
    "C9": mark("each branch adds ways through a function; with more than ten it can hardly be tested in full"),
    "D2": mark("docstrings of one form can be read by people and by tools"),
    "D3": mark("every tool looks for three double quotes"),
    "D4": mark("the first line of a docstring is a sentence that can be read alone, as in an index"),
    "D401": mark("start with an imperative: Return, Publish, Stop"),
    "bare-except": mark("a bare `except` also catches Ctrl-C and your own typing errors"),
    "print": mark("the node's logger adds the node, the time and the severity, and reaches /rosout"),
    "mutable-default": mark("a default is made once, so what one call changes in it the next call finds"),
    "sleep-in-callback": mark("while a callback sleeps, its thread receives no scan: the robot drives on blindly"),
}
_CRASHES = ("E9", "F821", "F822", "F823", "F70", "F72", "F50")
"""Rules of code that does not run: an undefined name, or no Python at all."""


def why(rule: str) -> str:
    """Return the reason for a rule, "" if none is known."""
    return next((say(WHY[rule[:end]]) for end in range(len(rule), 0, -1) if rule[:end] in WHY), "")


def listing(findings: Sequence[Finding]) -> str:
    """Return the findings as lines: each rule with its reason and some of its places.

    What would crash comes first, then the most frequent rule.
    """
    counts = Counter(finding.rule for finding in findings)
    lines: list[str] = []
    shown = 0
    for rule, count in sorted(counts.items(), key=lambda item: (not item[0].startswith(_CRASHES), -item[1], item[0])):
        some = [finding for finding in findings if finding.rule == rule][: min(_PLACES, MOST_SHOWN - shown)]
        shown += len(some)
        times = f" ({count} times)" if count > 1 else ""
        reason = f": {why(rule)}" if why(rule) else ""
        lines += [f"{rule}{times}{reason}"] * bool(some) + [f"  {place(each)} {each.text}" for each in some]
    if len(findings) > shown:
        lines.append(say("and {n} more", n=len(findings) - shown))
    return "\n".join(lines)


def place(finding: Finding) -> str:
    """Return "path:line"."""
    return f"{finding.path}:{finding.line}"


NAMESPACE = "robot7"
"""Where a trial with a launch file of the course's own has put the nodes."""
_OF_EVERY_NODE = {"rosout", "parameter_events"}


def wrong_topics(course: Course, graph: Graph, node: Node) -> Iterator[tuple[str, str, bool]]:
    """Yield each topic of the contract that the graph does not show as the contract has it, and that in words.

    The third is whether the graph shows something instead: the topic with another type, or its type elsewhere.
    """
    topics = {name: ("publisher", type_) for name, type_ in node.publishes.items()}
    topics |= {name: ("subscription", type_) for name, type_ in node.subscribes.items()}
    for topic, (kind, type_) in topics.items():
        message = course.full_type(type_)
        found = [endpoint for endpoint in graph.endpoints if endpoint.topic == topic]
        if any(e.kind == kind and _same_type(e.type, message, course) for e in found):
            continue
        others = sorted({e.topic for e in graph.endpoints if e.kind == kind and e.type == message} - set(topics))
        seen = say("found {others}", others=", ".join(others)) if others else say("found nothing similar")
        if found:
            seen = say("found {others}", others=", ".join(say("{e.kind} of {e.type}", e=e) for e in found))
        words = mark("expected a {kind} of {topic} ({message}); {seen}")
        yield topic, say(words, kind=kind, topic=topic, message=message, seen=seen), bool(found or others)


def _same_type(found: str, wanted: str, course: Course) -> bool:
    if wanted.startswith(course.package):
        return found.rpartition("/")[2] == wanted.rpartition("/")[2]
    return found == wanted


def absolute(graph: Graph | None, name: str) -> bool:
    """Return whether a node that runs in NAMESPACE has a topic, service or action of this name outside of it."""
    if graph is None:
        return False
    names = {endpoint.topic for endpoint in graph.endpoints} | {*graph.services, *graph.actions}
    return name in names and f"{NAMESPACE}/{name}" not in names


def near_miss(graph: Graph | None, wanted: str, contract: Collection[str]) -> str:
    """Return words that name the services and actions found instead of `wanted`, "" if there are none.

    None of those in the `contract` is a near miss of another.
    """
    if graph is None:
        return ""
    offered = {**graph.services, **graph.actions}
    if wanted in offered:
        return say("; found {wanted} of type {short_types}", wanted=wanted, short_types=short_types(offered[wanted]))
    others = {name: types for name, types in offered.items() if name not in contract}
    if not others:
        return ""
    return say("; found ") + ", ".join(f"{name} ({short_types(types)})" for name, types in sorted(others.items())[:4])


def near_topic(graph: Graph | None, wanted: str) -> str:
    """Return words that name the topics published instead of `wanted`, "" if there are none."""
    names = sorted({e.topic for e in graph.endpoints if e.kind == "publisher"} - _OF_EVERY_NODE) if graph else []
    if wanted in names:
        return say("; {wanted} is on the graph, but no message came", wanted=wanted)
    return say("; the node publishes {names}", names=", ".join(names)) if names else ""


def short_types(types: Sequence[str]) -> str:
    """Return "SetBool" for ["std_srvs/srv/SetBool"]; a type from a package of the robot keeps its package."""
    return ", ".join(name if "robot" in name else name.rpartition("/")[2] for name in types)
