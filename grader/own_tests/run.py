"""Run a package's own tests behind a wall, each module in a process of its own, and measure what they cover."""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from grader import build, sandbox, toolchain
from grader.evidence import FileCoverage, OwnTests, TestModule

MODULE_SECONDS = 90.0
_OUT_CAP = 5_000_000
_TAIL = 2000
_RC = Path(__file__).parent / "coveragerc"
# In-process only: what a submission installs must not become a plugin of the pytest that runs its tests.
_ENVIRONMENT = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "ROS_DOMAIN_ID": "7"}


def run_modules(
    package: Path,
    install: Path,
    modules: Sequence[TestModule],
    *,
    seconds: float = MODULE_SECONDS,
    workers: int = 1,
    progress: Callable[[str], None] = lambda _name: None,
) -> OwnTests:
    """Return the modules with their results, and what they cover of the package.

    Args:
        package: the package's source folder; a copy of it is the tests' working folder.
        install: the package's install tree.
        modules: what `read_modules` found; stubs are not run.
        seconds: wall time for each module.
        workers: how many modules run at once.
        progress: told the path of each module that has ended.
    """
    with tempfile.TemporaryDirectory(prefix="own-tests-") as scratch:
        room = Path(scratch)
        (room / "out").mkdir()
        rc = room / "coveragerc"
        rc.write_text(_RC.read_text().replace("@VERSION@", f"{sys.version_info.major}.{sys.version_info.minor}"))

        def one(numbered: tuple[int, TestModule]) -> TestModule:
            number, module = numbered
            if module.stub or not module.tests:
                return module
            done = _run_module(package, install, room, number, module, seconds)
            progress(module.path)
            return done

        with ThreadPoolExecutor(workers) as pool:
            done = list(pool.map(one, enumerate(modules)))
        return OwnTests(modules=done, coverage=_coverage(install, room))


def _run_module(
    package: Path, install: Path, room: Path, number: int, module: TestModule, seconds: float
) -> TestModule:
    folder = room / f"package{number}"
    shutil.copytree(package, folder, symlinks=True)
    out = room / "out"
    # The `pytest` script, not `python -m pytest`: that would put the source folder before the installed package.
    command = [
        "python3", "-m", "coverage", "run", "--rcfile=/ws/coveragerc", str(toolchain.PREFIX / "bin" / "pytest"),
        "-c", "/dev/null", "--rootdir=/ws/package", "-p", "no:cacheprovider", "-q", "-o", "addopts=",
        f"--junitxml=/ws/out/junit{number}.xml", module.path,
    ]  # fmt: skip
    wall = sandbox.Wall(
        read_only={install: str(build.INSTALL), room / "coveragerc": "/ws/coveragerc"},
        writable={folder: "/ws/package", out: "/ws/out"},
        environment=toolchain.environment(build.INSTALL, home=sandbox.HOME) | _ENVIRONMENT,
        cwd="/ws/package",
    )
    result = sandbox.run(command, wall, sandbox.Limits(wall_seconds=seconds))
    counted = _read_junit(out / f"junit{number}.xml")
    if counted is None:
        how = "ran out of time" if result.timed_out else f"pytest ended with status {result.exit_code} and no report"
        counted = replace(module, errors=max(1, module.tests), failures=[f"{module.path}: {how}"])
    return replace(
        counted,
        path=module.path, stub=module.stub, tests=module.tests, asserting=module.asserting, subjects=module.subjects,
        timed_out=result.timed_out, output_tail=result.output[-_TAIL:],
    )  # fmt: skip


def _read_junit(path: Path) -> TestModule | None:
    """Return the counts of a junit report; None if there is none. The file is the submission's word, read as data."""
    text = _read(path)
    if text is None or "<!DOCTYPE" in text or "<!ENTITY" in text:
        return None
    try:
        cases = list(ElementTree.fromstring(text).iter("testcase"))
    except ElementTree.ParseError:
        return None
    counts = {"failure": 0, "error": 0, "skipped": 0}
    failures = []
    for case in cases:
        for kind in counts:
            node = case.find(kind)
            if node is not None:
                counts[kind] += 1
                if kind != "skipped":
                    message = " ".join((node.get("message") or "").split())[:200]
                    failures.append(f"{str(case.get('name'))[:100]}: {message}")
    bad = sum(counts.values())
    return TestModule(
        path="", stub=False, tests=0, asserting=0, subjects=[], passed=max(0, len(cases) - bad),
        failed=counts["failure"], errors=counts["error"], skipped=counts["skipped"], failures=failures[:20],
    )  # fmt: skip


def _coverage(install: Path, room: Path) -> list[FileCoverage]:
    """Return what all modules together reached. Combined behind the wall too: the data are the submission's."""
    if not list((room / "out").glob("coverage.*")):
        return []
    source = next(iter(sorted(room.glob("package*"))))
    wall = sandbox.Wall(
        read_only={install: str(build.INSTALL), room / "coveragerc": "/ws/coveragerc", source: "/ws/package"},
        writable={room / "out": "/ws/out"},
        environment=toolchain.environment(home=sandbox.HOME),
        cwd="/ws/out",
    )
    script = "coverage combine -q --rcfile=/ws/coveragerc; coverage json -q --rcfile=/ws/coveragerc -o /ws/out/all.json"
    sandbox.run(["sh", "-c", script], wall)
    text = _read(room / "out" / "all.json")
    try:
        files = json.loads(text or "{}").get("files", {})
        return [_file(name, data["summary"], data["missing_lines"]) for name, data in sorted(files.items())]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return []


def _file(name: str, summary: dict[str, int], missing: list[int]) -> FileCoverage:
    return FileCoverage(
        path=name.removeprefix("../").removeprefix("/ws/").removeprefix("package/")[:200],
        lines=int(summary["num_statements"]),
        lines_hit=int(summary["covered_lines"]),
        branches=int(summary["num_branches"]),
        branches_hit=int(summary["covered_branches"]),
        missing=[int(line) for line in missing][:500],
    )


def _read(path: Path) -> str | None:
    try:
        if path.is_symlink() or not path.is_file() or path.stat().st_size > _OUT_CAP:
            return None
        return path.read_text(errors="replace")
    except OSError:
        return None
