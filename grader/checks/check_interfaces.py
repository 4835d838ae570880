"""I3: the four interfaces, and the nodes' use of them."""

import re

from grader.checks.first_cause import sentence
from grader.checks.judge import OFFERED, Judge, near_miss, short_types
from grader.contract import definition
from grader.contract.spec import PACKAGE
from grader.evidence import Fault


def test_type_hashes_match_the_contract(judge: Judge) -> None:
    """The four interfaces have the contract's type hashes: exactly its fields, in its order."""
    judge.require_build("interfaces")
    build = judge.evidence.build
    wrong: list[str] = []
    different = 0
    for name, expected in build.contract_hashes.items():
        if build.type_hashes.get(name) != expected:
            wrong += _differences(judge, name)
            different += 1
    if wrong:
        share = 1 - different / len(build.contract_hashes)
        judge.share(share, "\n".join(wrong), "compare the file with the contract line by line: types, names, order")


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
    kind = name.partition("/")[0]
    path = f"{name}.{kind}"
    found = build.interface_texts.get(name)
    if not found:
        faults = [fault for fault in judge.faults("install", "interfaces") if path in (fault.path, *_quoted(fault))]
        shown = [f"{sentence(fault)} ({fault.cure})" for fault in faults]
        return [f"{path}: not found among the installed interfaces", *shown]
    differences = definition.differences(kind, found, build.contract_texts.get(name, ""))
    said = [f"{path}{f':{line}' if line else ''}: {words}" for line, words in differences]
    return said or [f"{path}: its fields are the contract's, and the type has another name"]


def _quoted(fault: Fault) -> list[str]:
    return re.findall(r"`([^`]+)`", fault.text)
