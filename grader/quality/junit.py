"""test_results.xml, the student's word on their own tests, read as data: no entities, no tree, a limit on its size."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.parsers import expat

from grader.evidence import TestReport
from grader.quality.modules import Module, is_test
from grader.sanitize import printable

NAME = "test_results.xml"
MOST_BYTES = 4 * 1024 * 1024
_MOST_CASES = 5000


def read_report(package: Path, files: Sequence[str]) -> TestReport | None:
    """Return what test_results.xml beside package.xml says, None if there is none."""
    if NAME not in files:
        return None
    with (package / NAME).open("rb") as stream:
        data = stream.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        return TestReport(NAME, problem=f"is larger than {MOST_BYTES // 1024**2} MB")
    reader = _Reader()
    try:
        reader.parser.Parse(data, True)
    except _NotAllowed:
        return TestReport(NAME, problem="declares a DOCTYPE, which a junit report does not have")
    except (expat.ExpatError, ValueError, LookupError) as error:
        return TestReport(NAME, problem=f"is not XML: {printable(str(error))}")
    if reader.root not in ("testsuite", "testsuites"):
        return TestReport(NAME, problem=f"begins with <{printable(reader.root)}>, a junit report with <testsuites>")
    return TestReport(NAME, cases=reader.cases[:_MOST_CASES], failed=reader.failed)


def tests_of(modules: Sequence[Module]) -> Iterator[str]:
    """Yield the tests that the package's test modules hold, as "module::name"."""
    for module in modules:
        if module.role != "test":
            continue
        for node in module.tree.body:
            members = node.body if isinstance(node, ast.ClassDef) else [node]
            for member in members:
                if is_test(member):
                    yield f"{module.stem}::{member.name}"


class _NotAllowed(Exception):
    """A document type: the door to entity expansion."""


class _Reader:
    """Collects the test cases."""

    def __init__(self) -> None:
        self.root = ""
        self.cases: list[str] = []
        self.failed = 0
        self.parser = expat.ParserCreate()
        self.parser.StartDoctypeDeclHandler = self._refuse
        self.parser.StartElementHandler = self._start

    def _refuse(self, *_: object) -> None:
        raise _NotAllowed

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.root = self.root or tag
        if tag == "testcase" and len(self.cases) < _MOST_CASES:
            # pytest writes the values of a parametrized test behind its name.
            name = attributes.get("name", "").partition("[")[0]
            where = attributes.get("classname", "") or attributes.get("file", "")
            self.cases.append(f"{printable(where)}::{printable(name)}")
        elif tag in ("failure", "error"):
            self.failed += 1
