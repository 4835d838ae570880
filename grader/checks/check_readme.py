"""Q5: README.md, and its tables of interfaces against those that the nodes have."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence

from grader.checks.judge import Failed, Judge, NotReached
from grader.checks.package_text import weigh
from grader.course import Node
from grader.evidence import CodeInterface, Evidence, Readme, Table
from grader.words import MOST_SHOWN, mark, say

NEEDS = ("quality", "linters", "idle", "readme")

_WORDS = 10  # of prose, one sentence; fewer cannot say what a package does
_COMMANDS = {
    "build": mark("how to build it (colcon build)"),
    "run": mark("how to run it (ros2 launch or ros2 run)"),
    "test": mark("how to test it (pytest or colcon test)"),
}


def test_readme_says_what_and_how(judge: Judge) -> None:
    """README.md says what the package does, and how to build, run and test it."""
    weigh(judge)
    quality = judge.quality()
    readme = quality.readme
    if readme is None:
        others = [path for path in quality.paths if path.lower().startswith("readme")]
        found = say("; found {others}", others=", ".join(others)) if others else ""
        seen = say("there is no README.md beside package.xml{found}", found=found)
        raise Failed(seen, say("write README.md in the package"))
    missing = []
    if readme.words < _WORDS:
        said = mark("what it does ({readme.words} words of prose; at least {words} are needed)")
        missing.append(say(said, readme=readme, words=_WORDS))
    elif readme.placeholders:
        places = ", ".join(f"{found.line}: {found.text}" for found in readme.placeholders[:3])
        missing.append(say("what it does; there is a placeholder (line {places})", places=places))
    missing += [say(words) for what, words in _COMMANDS.items() if what not in readme.shows]
    if missing:
        seen = "\n".join([say("not found:"), *missing, *_hidden(readme)])
        try_ = say("write for a reader who is new to the package, with commands to copy")
        judge.share(1 - len(missing) / 4, seen, try_)


def test_interface_table_agrees(judge: Judge) -> None:
    """README.md holds a table of the nodes' interfaces that agrees with the running nodes: names, types, directions."""
    weigh(judge)
    readme = judge.quality().readme
    if readme is None:
        raise NotReached(say("there is no README.md"))
    wanted, wrong, from_graph = agreement(readme.tables, judge.evidence, judge.course.nodes.values())
    see = say("see {requirement}", requirement=judge.course.requirement_of("check_graph") or say("the contract"))
    judge.expect(bool(wanted), say("neither the running nodes nor the code show an interface"), see)
    if wrong:
        source = say("the running nodes") if from_graph else say("the code")
        head = say("compared with {source}:", source=source)
        node = next(iter(judge.course.nodes.values()))
        topic, type_ = next(iter(node.subscribes.items()))
        try_ = say("one row for each interface: | {cells} |", cells=f"{node.name} | subscribes | {topic} | {type_}")
        judge.share(1 - len(wrong) / wanted, "\n".join([head, *wrong[: MOST_SHOWN * 2], *_hidden(readme)]), try_)


def _hidden(readme: Readme) -> list[str]:
    """Return a line about what a reader of the page does not see, if there is any."""
    words = mark("{n} words do not count: they are in comments, or in HTML that `hidden`, `style` or `class` may hide")
    return [say(words, n=readme.hidden)] if readme.hidden else []


# Every node has these; a README need not list them.
_OF_RCLPY = {"parameter_events", "rosout", "clock"}
_DIRECTIONS = {
    "publisher": re.compile(r"\b(pub\w*|out\w*|sends?|writes?)\b", re.IGNORECASE),
    "subscription": re.compile(r"\b(sub\w*|inp?\w*|receives?|reads?|listens?)\b", re.IGNORECASE),
}
_TYPE = re.compile(r"\b[a-z][a-z0-9_]*(?:/(?:msg|srv|action))?/[A-Z]\w*\b")
_CAMEL = re.compile(r"[A-Z][a-z0-9]+[A-Z]\w*")
_NAME = re.compile(r"(?<![\w/])/?[A-Za-z_~][\w/]*")


def agreement(tables: Sequence[Table], evidence: Evidence, contract: Collection[Node]) -> tuple[int, list[str], bool]:
    """Compare the tables of a README with the nodes on the graph, or with the code of nodes that did not run.

    Returns how many rows are wanted, in words what is wrong or missing, and whether any node is on the graph.
    """
    seen = list(_running(evidence, contract))
    nodes = {interface.node for interface in seen}
    # A node that did not come up is compared by its code: the README is not to blame.
    written = [item for item in (evidence.quality.interfaces if evidence.quality else []) if item.node not in nodes]
    wanted = list({(item.node, item.kind, item.name, item.type): item for item in [*seen, *written]}.values())
    read = [[_Row(table.head, row) for row in table.rows] for table in tables]
    rows = [row for table in read for row in table]
    topics = {item.type for item in wanted if item.kind in _DIRECTIONS}
    names = {item.node for item in wanted}
    wrong = [words for interface in wanted if (words := _missing(interface, rows, topics, names))]
    # The code may create more than its calls show, so only the graph can prove that an interface is not there. A table
    # in which no row names an interface of a node is about something else, such as the fields of the messages.
    if nodes == {node.name for node in contract}:
        own = {interface.name for interface in wanted}
        about_nodes = [table for table in read if any(row.names & own for row in table)]
        stale = [row for table in about_nodes for row in table if row.has_type and not row.names & (own | _OF_RCLPY)]
        wrong += [say("no node has the interface of this row: {text_}", text_=row.text[:120]) for row in stale]
    return len(wanted), wrong, bool(seen)


class _Row:
    """A row of a table: the names in its cells, and the directions they give."""

    def __init__(self, head: Sequence[str], cells: Sequence[str]) -> None:
        self.text = " | ".join(cells)
        self.cells = [cell.replace("::", "/") for cell in cells]
        self.heads = list(head)
        self.names = set[str]().union(*map(_names, self.cells))
        self.last_names = {name.rpartition("/")[2] for name in self.names}
        full = _TYPE.findall(" ".join(self.cells))
        self.has_type = bool(full)
        self.types = {name.rpartition("/")[2] for name in full} | set(filter(_CAMEL.fullmatch, self.last_names))
        """Names that look like a type: those with a package, and words such as LaserScan."""

    def directions(self, name: str) -> set[str]:
        """Return "publisher" or "subscription" as this row has it for `name`: in its column's head, or in a cell."""
        found: set[str] = set()
        for number, cell in enumerate(self.cells):
            words = [self.heads[number] if number < len(self.heads) else ""] if name in _names(cell) else [cell]
            found |= {kind for kind, said in _DIRECTIONS.items() if any(said.search(word) for word in words)}
        return found

    def is_of_another(self, interface: CodeInterface, nodes: set[str]) -> bool:
        """Return whether a cell names another node alone, and none this one; a column may be for the other end."""
        others = nodes - {interface.node}
        heads = [*self.heads, *[""] * len(self.cells)]
        ends = [said for kind, said in _DIRECTIONS.items() if kind != interface.kind]
        cells = [cell for cell, head in zip(self.cells, heads, strict=False) if not any(e.search(head) for e in ends)]
        return interface.node not in self.last_names and any(_names(cell) and _names(cell) <= others for cell in cells)


def _names(cell: str) -> set[str]:
    return {name.strip("/~") for name in _NAME.findall(cell)}


def _missing(interface: CodeInterface, rows: Sequence[_Row], topics: set[str], nodes: set[str]) -> str:
    """Return what the tables get wrong about an interface, "" if a row is right. `topics` are the types of topics."""
    named = [row for row in rows if interface.name in row.names]
    what = f"{interface.node}: {interface.kind} {interface.name} ({interface.type})"
    if not named:
        return say("{what} is not in a table", what=what)
    typed = [row for row in named if interface.type in row.last_names]
    if interface.kind not in _DIRECTIONS:
        # The contract's own table names services and actions without their types.
        typed += [row for row in named if not row.types - topics]
    if not typed:
        return say("{what} is listed with another type or with none: {text_}", what=what, text_=named[0].text[:120])
    own = [row for row in typed if not row.is_of_another(interface, nodes)]
    if not own:
        return say("{what} is listed under another node: {text_}", what=what, text_=typed[0].text[:120])
    said = [row.directions(interface.name) for row in own] if interface.kind in _DIRECTIONS else [set()]
    if all(kinds and interface.kind not in kinds for kinds in said):
        return say("{what} is listed with another direction: {text_}", what=what, text_=own[0].text[:120])
    return ""


def _running(evidence: Evidence, contract: Collection[Node]) -> Iterator[CodeInterface]:
    for node in contract:
        trial = evidence.trials.get(f"idle_{node.name}")
        graph = trial.graph if trial is not None and trial.ready else None
        if graph is None:
            continue
        for endpoint in graph.endpoints:
            if endpoint.topic not in _OF_RCLPY and "/_action/" not in endpoint.topic:
                yield CodeInterface(node.name, endpoint.kind, endpoint.topic, endpoint.type.rpartition("/")[2])
        for kind, offered in (("service", graph.services), ("action", graph.actions)):
            for what, types in offered.items():
                yield CodeInterface(node.name, kind, what, types[0].rpartition("/")[2] if types else "")
