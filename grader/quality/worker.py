"""Read a package's text into facts and print them as JSON, in a process of its own that hostile text may crash.

python -I -m grader.quality.worker COURSE PACKAGE INTERFACES SOURCES [--lint]; COURSE is a course's folder, SOURCES a
JSON list of [path, copy] of Python files.
"""

from __future__ import annotations

import ast
import itertools
import json
import logging
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import evidence
from grader.course import Course, load
from grader.evidence import TestReport, reading_limits
from grader.intake.package_xml import read_xml
from grader.python_ast import is_test
from grader.quality.contract_use import created_interfaces, function_use, parameter_use
from grader.quality.faults import find_faults
from grader.quality.linting import bad_habits, by_flake8, duplicated_blocks, public_definitions, with_violations
from grader.quality.manifest import read_manifest
from grader.quality.package_sources import read_sources
from grader.quality.parsed_module import CallGraph, Module, functions_of, installed_as, parse
from grader.quality.readme import read_readme
from grader.quality.source_files import package_files
from grader.sanitize import printable

_MAX_ENTRIES = 2000
_MAX_INTERFACES = 200
_MAX_TEXT = 2000
Sources = Sequence[tuple[str, str]]


def main() -> int:
    """Print the facts."""
    logging.disable()  # pydocstyle's
    course, package, interfaces, listing, *lint = sys.argv[1:]
    sources = json.loads(Path(listing).read_text())
    beside = Path(interfaces) if interfaces else None
    facts = package_facts(Path(package), beside, sources, course=load(Path(course)), lint=bool(lint))
    print(json.dumps(_cut(json.loads(evidence.to_json(facts)))))
    return 0


def _cut(value: Any) -> Any:
    """Return JSON data with its texts cut: Python sets no limit to the length of a name."""
    if isinstance(value, str):
        return value[:_MAX_TEXT]
    if isinstance(value, list):
        return [_cut(item) for item in value]
    return {_cut(key): _cut(item) for key, item in value.items()} if isinstance(value, dict) else value


def package_facts(
    package: Path, interfaces: Path | None, sources: Sources, *, course: Course, lint: bool = False
) -> evidence.Quality:
    """Return the facts of the text of `package`; `interfaces` is its package of interfaces, if it has one.

    Each source is a path with that of its copy. With `lint` there is also what flake8 finds, and pydocstyle.
    """
    text = read_sources(package, interfaces, course)
    name = text.xml.name
    modules, files = _parse(sources, course)
    modules = installed_as(modules, name)
    paths = text.paths
    graph = CallGraph(modules)
    public = [item for module in modules for item in public_definitions(module)]
    if len(public) > reading_limits.MAX_DEFINITIONS:
        files.append(evidence.SourceFile(public[reading_limits.MAX_DEFINITIONS].path, 0, reading_limits.TOO_PUBLIC))
    public = public[: reading_limits.MAX_DEFINITIONS]
    by_rules: tuple[list[evidence.Finding], list[evidence.Finding]] = ([], [])
    if lint:
        # Linters see only what can be parsed: anything else would merely probe their weak spots.
        read = {module.path for module in modules}
        copies = {path: copy for path, copy in sources if path in read}
        public = with_violations(public, copies)
        by_rules = by_flake8(copies) if copies else by_rules
    created = list(created_interfaces(graph, course.nodes))[:_MAX_INTERFACES]
    facts = evidence.Quality(
        manifest=read_manifest(text, modules),
        paths=[printable(path) for path in paths][:_MAX_ENTRIES],
        files=files,
        definitions=public,
        style=by_rules[0],
        complex=by_rules[1],
        copies=duplicated_blocks(modules),
        habits=bad_habits(modules, graph)[:_MAX_ENTRIES],
        functions=function_use(graph, course.functions),
        parameters=parameter_use(modules, course.nodes.values()),
        interfaces=created,
        readme=read_readme(package, paths, {course.package, name}),
        report=read_report(package, paths),
        tests=sorted(set(names_of_tests(modules)))[:_MAX_ENTRIES],
        faults=find_faults(text, interfaces, modules, [file for file in files if file.problem]),
    )
    if interfaces is not None:
        # The contract's interface files, and what builds them, count wherever they are in the submission.
        moved = ("CMakeLists.txt", "msg", "srv", "action")
        inside = [path for path in package_files(interfaces, course) if path.split("/")[0] in moved]
        facts = replace(facts, paths=sorted({*facts.paths, *map(printable, inside)}))
    return facts


def _parse(sources: Sources, course: Course) -> tuple[list[Module], list[evidence.SourceFile]]:
    modules, files = [], []
    left = reading_limits.MAX_CONSTANT_LINES
    for path, copy in sources:
        try:
            module = parse(path, Path(copy).read_bytes(), course.package)
        except ValueError as error:
            files.append(evidence.SourceFile(path, 0, problem=f"is not valid Python: {printable(str(error))}"))
        else:
            modules.append(module)
            constants = min(module.constants, left)
            left -= constants
            functions = functions_of(module.tree)
            inside = sum(any(first <= line <= last for first, last in functions) for line in module.code)
            lines = module.lines - module.constants + constants
            files.append(evidence.SourceFile(path, lines, "", lines - inside, functions))
    return modules, files


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


if __name__ == "__main__":
    sys.exit(main())
