"""I3: the four interfaces, and the nodes' use of them."""

from grader.checks.first_cause import sentence
from grader.checks.judge import OFFERED, Judge, near_miss, short_types
from grader.contract import definition
from grader.contract.spec import PACKAGE


def test_type_hashes_match_the_contract(judge: Judge) -> None:
    """The four interfaces have the contract's type hashes: exactly its fields, in its order."""
    judge.require_build("interfaces")
    build = judge.evidence.build
    different = [name for name, expected in build.contract_hashes.items() if build.type_hashes.get(name) != expected]
    if different:
        share = 1 - len(different) / len(build.contract_hashes)
        unwritten = judge.unwritten(_path(name) for name in different if not build.interface_texts.get(name))
        try_ = "compare the file with the contract line by line: types, names, order"
        if len(unwritten) == len(different):
            where = ", in a package with a CMakeLists.txt" * (judge.installer == "setup.py")
            try_ = f"write {', '.join(unwritten)} as the contract says{where}"
        seen = "\n".join(words for name in different for words in _differences(judge, name))
        judge.share(share, seen, try_)


def test_nodes_use_the_contracts_types(judge: Judge) -> None:
    """The nodes use the interfaces under the contract's type names."""
    wrong = []
    controller = judge.graph("idle")
    offered = {**controller.services, **controller.actions}
    for name, kind in OFFERED.items():
        if f"{PACKAGE}/{kind}" not in offered.get(name, []):
            wrong.append(f"expected {name} ({kind.partition('/')[2]}){near_miss(controller, name)}")
    processor = judge.graph("idle_processor")
    types = {e.type for e in processor.endpoints if e.topic == "sensor_fusion_data" and e.kind == "publisher"}
    if f"{PACKAGE}/msg/SensorFusionData" not in types:
        found = f"found type {short_types(sorted(types))}" if types else "found no such publisher"
        wrong.append(f"expected sensor_fusion_data (SensorFusionData); {found}")
    if wrong:
        judge.share(1 - len(wrong) / 4, "; ".join(wrong), f"import the types from {PACKAGE}.srv, .action and .msg")


def _differences(judge: Judge, name: str) -> list[str]:
    """Return in words how an installed definition, such as "srv/SetSpeed", differs from the contract's."""
    build = judge.evidence.build
    kind, path = name.partition("/")[0], _path(name)
    found = build.interface_texts.get(name)
    if not found:
        faults = [fault for fault in judge.faults("install", "interfaces") if path in (fault.path, *fault.lacks)]
        shown = [f"{sentence(fault)} ({fault.cure})" for fault in faults]
        return [f"{path}: not found among the installed interfaces", *shown]
    differences = definition.differences(kind, found, build.contract_texts.get(name, ""))
    said = [f"{path}{f':{line}' if line else ''}: {words}" for line, words in differences]
    return said or [f"{path}: its fields are the contract's, and the type has another name"]


def _path(name: str) -> str:
    """Return the path of the interface file of "srv/SetSpeed"."""
    return f"{name}.{name.partition('/')[0]}"
