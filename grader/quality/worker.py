"""Read a package's text into facts and print them as JSON. A process of its own, so that hostile text costs only it.

python -I -m grader.quality.worker PACKAGE INTERFACES SOURCES; SOURCES is a JSON list of [path, copy] of Python files.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import evidence
from grader.evidence import reading_limits
from grader.quality import duplicates, habits, manifest, parameters
from grader.quality.call_graph import Calls
from grader.quality.conversions import conversions
from grader.quality.definitions import definitions
from grader.quality.interfaces import interfaces
from grader.quality.junit import read_report, tests_of
from grader.quality.modules import Module, parse
from grader.quality.readme import read_readme
from grader.quality.source_files import package_files
from grader.sanitize import printable

_MOST = 2000
_LONGEST_TEXT = 2000


def main() -> int:
    """Print the facts."""
    package, beside = Path(sys.argv[1]), Path(sys.argv[2]) if sys.argv[2] else None
    found = read(package, beside, json.loads(Path(sys.argv[3]).read_text()))
    print(json.dumps(_cut(json.loads(evidence.to_json(found)))))
    return 0


def _cut(value: Any) -> Any:
    """Return what is to be printed with its texts cut: Python sets no limit to the length of a name."""
    if isinstance(value, str):
        return value[:_LONGEST_TEXT]
    if isinstance(value, list):
        return [_cut(item) for item in value]
    return {_cut(key): _cut(item) for key, item in value.items()} if isinstance(value, dict) else value


def read(package: Path, beside: Path | None, sources: list[tuple[str, str]]) -> evidence.Quality:
    """Return what the text of `package` shows; `beside` is its package of interfaces, if it has one."""
    modules, files = _parse(sources)
    paths = package_files(package)
    calls = Calls(modules)
    public = [item for module in modules for item in definitions(module)]
    if len(public) > reading_limits.MOST_DEFINITIONS:
        files.append(evidence.SourceFile(public[reading_limits.MOST_DEFINITIONS].path, 0, reading_limits.TOO_PUBLIC))
    found = evidence.Quality(
        manifest=manifest.read_manifest(package, paths, modules),
        paths=[printable(path) for path in paths][:_MOST],
        files=files,
        definitions=public[: reading_limits.MOST_DEFINITIONS],
        copies=duplicates.copies(modules),
        habits=habits.habits(modules, calls)[:_MOST],
        conversions=conversions(calls),
        parameters=parameters.parameters(modules),
        interfaces=list(interfaces(calls))[:200],
        readme=read_readme(package, paths),
        report=read_report(package, paths),
        tests=sorted(set(tests_of(modules)))[:_MOST],
    )
    if beside is not None:
        # The contract's interface files count where they are; the package of their own is part of what is handed in.
        inside = [path for path in package_files(beside) if path.split("/")[0] in ("msg", "srv", "action")]
        found = replace(found, paths=sorted({*found.paths, *map(printable, inside)}))
    return found


def _parse(sources: list[tuple[str, str]]) -> tuple[list[Module], list[evidence.SourceFile]]:
    modules, files = [], []
    left = reading_limits.MOST_CONSTANT_LINES
    for path, copy in sources:
        try:
            module = parse(path, Path(copy).read_bytes())
        except ValueError as error:
            files.append(evidence.SourceFile(path, 0, problem=f"is no Python: {printable(str(error))}"))
        else:
            modules.append(module)
            told = min(module.constants, left)
            left -= told
            files.append(evidence.SourceFile(path, module.lines - module.constants + told))
    return modules, files


if __name__ == "__main__":
    sys.exit(main())
