"""Read test_results.xml, the student's own report of their tests, and list the tests that the package holds."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from grader.evidence import TestReport
from grader.intake.package_xml import read_xml
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
    try:
        root = read_xml(package / NAME, _MAX_BYTES)
    except ValueError as error:
        return TestReport(NAME, str(error))
    if root.tag not in ("testsuite", "testsuites"):
        return TestReport(NAME, f"begins with <{printable(root.tag)}>, a junit report with <testsuites>")
    cases = itertools.islice(root.iter("testcase"), _MAX_CASES)
    failed = sum(element.tag in ("failure", "error") for element in root.iter())
    return TestReport(NAME, cases=[_name(case.attrib) for case in cases], failed=failed)


def _name(case: Mapping[str, str]) -> str:
    # pytest appends the values of a parametrized test to its name.
    name = case.get("name", "").partition("[")[0]
    where = case.get("classname", "") or case.get("file", "")
    return f"{printable(where)}::{printable(name)}"


def names_of_tests(modules: Sequence[Module]) -> Iterator[str]:
    """Yield the tests in the package's test modules, as "module::name"."""
    for module in modules:
        if module.role == "test":
            for node in module.tree.body:
                for member in node.body if isinstance(node, ast.ClassDef) else [node]:
                    if is_test(member):
                        yield f"{module.stem}::{member.name}"
