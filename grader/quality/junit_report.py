"""Read test_results.xml, the student's own report of their tests, and list the tests that the package holds."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path

from grader.evidence import TestReport
from grader.intake.xml_reader import read_xml
from grader.python_ast import is_test
from grader.quality.parsed_module import Module
from grader.sanitize import printable

NAME = "test_results.xml"
_MAX_BYTES = 4 * 1024 * 1024
_MAX_CASES = 5000


def read_report(package: Path, files: Sequence[str]) -> TestReport | None:
    """Return what test_results.xml beside package.xml says, None if there is none."""
    if NAME not in files:
        return None
    reader = _Reader()
    problem = read_xml(package / NAME, _MAX_BYTES, reader.start)
    if not problem and reader.root not in ("testsuite", "testsuites"):
        problem = f"begins with <{printable(reader.root)}>, a junit report with <testsuites>"
    return TestReport(NAME, problem) if problem else TestReport(NAME, cases=reader.cases, failed=reader.failed)


def names_of_tests(modules: Sequence[Module]) -> Iterator[str]:
    """Yield the tests in the package's test modules, as "module::name"."""
    for module in modules:
        if module.role == "test":
            for node in module.tree.body:
                for member in node.body if isinstance(node, ast.ClassDef) else [node]:
                    if is_test(member):
                        yield f"{module.stem}::{member.name}"


class _Reader:
    """Collects the test cases."""

    def __init__(self) -> None:
        self.root = ""
        self.cases: list[str] = []
        self.failed = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.root = self.root or tag
        if tag == "testcase" and len(self.cases) < _MAX_CASES:
            # pytest appends the values of a parametrized test to its name.
            name = attributes.get("name", "").partition("[")[0]
            where = attributes.get("classname", "") or attributes.get("file", "")
            self.cases.append(f"{printable(where)}::{printable(name)}")
        elif tag in ("failure", "error"):
            self.failed += 1
