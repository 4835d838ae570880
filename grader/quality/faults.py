"""Find what will go wrong when a package is built or run, from its text alone, so that it can be said without a build.

Only what is certain, or nearly so, is a fault: a variable of unknown value in CMakeLists.txt, or a module that may
come from elsewhere, gives none.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from grader.course import Course
from grader.evidence import Fault, SourceFile
from grader.quality.faults_of_build import build_faults, interface_build_faults
from grader.quality.faults_of_files import file_faults, interface_faults
from grader.quality.faults_of_programs import program_faults
from grader.quality.faults_of_start import start_faults
from grader.quality.package_sources import PackageSources, read_sources
from grader.quality.parsed_module import Module
from grader.sanitize import printable

_ORDER = ("build", "install", "start", "parameters", "interfaces")
_MAX_FAULTS = 50
_MAX_WORDS = 300


def find_faults(
    sources: PackageSources, interfaces: Path | None, modules: Sequence[Module], unreadable: Sequence[SourceFile]
) -> list[Fault]:
    """Return the faults of a package, the first cause first.

    `interfaces` is its package of interfaces, if it has one; `unreadable` are its Python files that cannot be parsed.
    """
    every = itertools.chain(
        _beside(interfaces, sources.course),
        start_faults(sources, modules, unreadable), program_faults(sources, modules),
        build_faults(sources), file_faults(sources), interface_faults(sources),
    )  # fmt: skip
    found = itertools.islice(every, 2 * _MAX_FAULTS)  # looking for what was meant takes time
    return [_printable(fault) for fault in sorted(found, key=lambda fault: _ORDER.index(fault.stops))[:_MAX_FAULTS]]


def _beside(interfaces: Path | None, course: Course) -> Iterator[Fault]:
    """Yield the faults of the package of interfaces, if there is one, with its folder in their paths."""
    if interfaces is not None:
        sources = read_sources(interfaces, None, course)
        for fault in (*interface_build_faults(sources), *interface_faults(sources)):
            yield replace(fault, path=f"{interfaces.name}/{fault.path}")


def _printable(fault: Fault) -> Fault:
    return replace(
        fault,
        path=printable(fault.path),
        text=printable(fault.text)[:_MAX_WORDS],
        cure=printable(fault.cure)[:_MAX_WORDS],
        shown_as=[word[:_MAX_WORDS] for word in fault.shown_as[:_MAX_FAULTS]],
        lacks=fault.lacks[:_MAX_FAULTS],
    )
