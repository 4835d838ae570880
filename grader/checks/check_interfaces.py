"""The contract's interfaces, and the nodes' use of them."""

from grader.checks.first_cause import with_cure
from grader.checks.judge import Judge
from grader.checks.wording import near_miss, short_types
from grader.course import definition
from grader.words import mark, say

NEEDS = ("idle",)


def test_type_hashes_match_the_contract(judge: Judge) -> None:
    """The interfaces have the contract's type hashes: exactly its fields, in its order."""
    judge.require_build("interfaces")
    build = judge.evidence.build
    different = [name for name, expected in build.contract_hashes.items() if build.type_hashes.get(name) != expected]
    if different:
        share = 1 - len(different) / len(build.contract_hashes)
        unwritten = judge.unwritten(_path(name) for name in different if not build.interface_texts.get(name))
        try_ = say("compare the file with the contract line by line: types, names, order")
        if len(unwritten) == len(different):
            words = mark("write {unwritten} as the contract says, in a package with a CMakeLists.txt")
            try_ = say(words, unwritten=", ".join(unwritten))
        seen = "\n".join(words for name in different for words in _differences(judge, name))
        judge.share(share, seen, try_)


def test_nodes_use_the_contracts_types(judge: Judge) -> None:
    """The nodes use the interfaces under the contract's type names."""
    course, wrong, count = judge.course, [], 0
    for node in course.nodes.values():
        graph = judge.graph(f"idle_{node.name}")
        # Under whatever name: another check judges the names.
        used = {type_ for types in (*graph.services.values(), *graph.actions.values()) for type_ in types}
        used |= {end.type for end in graph.endpoints if end.kind == "publisher"}
        own = [(name, type_) for name, type_ in {**node.offers, **node.publishes}.items() if type_ in course.interfaces]
        count += len(own)
        for name, type_ in own:
            if course.full_type(type_) not in used:
                found = near_miss(graph, name, course.offered)
                if name in node.publishes:
                    types = sorted({end.type for end in graph.endpoints if end.topic == name})
                    found = (
                        say("; found type {types}", types=short_types(types)) if types else say("; found no such topic")
                    )
                words = mark("expected {name} ({short}){near_miss}")
                wrong.append(say(words, name=name, short=type_.rpartition("/")[2], near_miss=found))
    if wrong:
        try_ = say("import the types from {course.package}.srv, .action and .msg", course=course)
        judge.share(1 - len(wrong) / count, "; ".join(wrong), try_)


def _differences(judge: Judge, name: str) -> list[str]:
    """Return in words how an installed definition, such as "srv/SetSpeed", differs from the contract's."""
    build = judge.evidence.build
    kind, path = name.partition("/")[0], _path(name)
    found = build.interface_texts.get(name)
    if not found:
        faults = [fault for fault in judge.faults("install", "interfaces") if path in (fault.path, *fault.lacks)]
        return [say("{path}: not found among the installed interfaces", path=path), *map(with_cure, faults)]
    differences = definition.differences(kind, found, build.contract_texts.get(name, ""))
    said = [f"{path}{f':{line}' if line else ''}: {words}" for line, words in differences]
    return said or [say("{path}: its fields are the contract's, and the type has another name", path=path)]


def _path(name: str) -> str:
    """Return the path of the interface file of "srv/SetSpeed"."""
    return f"{name}.{name.partition('/')[0]}"
