"""I3: the four interfaces, and the nodes' use of them."""

from grader.checks.judge import OFFERED, Judge, near_miss, short_types
from grader.contract.spec import PACKAGE


def test_type_hashes_match_the_contract(judge: Judge) -> None:
    """The four interfaces have the contract's type hashes: exactly its fields, in its order."""
    judge.require_build()
    build = judge.evidence.build
    wrong = []
    for name, expected in build.contract_hashes.items():
        if build.type_hashes.get(name) != expected:
            wrong.append(f"{name}: {_difference(build.interface_texts.get(name), build.contract_texts.get(name, ''))}")
    if wrong:
        share = 1 - len(wrong) / len(build.contract_hashes)
        judge.share(share, "; ".join(wrong), "compare the file with the contract line by line: types, names, order")


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


def _difference(found: str | None, wanted: str) -> str:
    """Return in words how two definitions differ, apart from comments and spaces."""
    if not found:
        return "not found among the installed interfaces"
    theirs, ours = _fields(found), _fields(wanted)
    missing = [field for field in ours if field not in theirs]
    extra = [field for field in theirs if field not in ours]
    if missing or extra:
        parts = [f"missing {', '.join(missing)}"] if missing else []
        parts += [f"not in the contract: {', '.join(extra)}"] if extra else []
        return "; ".join(parts)
    return "the fields are not in the contract's order" if theirs != ours else "another type name"


def _fields(text: str) -> list[str]:
    lines = (" ".join(line.partition("#")[0].split()) for line in text.splitlines())
    return [line for line in lines if line]
