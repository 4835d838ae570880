"""The clinic: `admit` lays out a broken package in a workspace of its own, `check` judges diagnosis and cure."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from grader import building
from grader.errors import GraderError
from grader.host import ros_env
from grader.notebook import cell_hooks, checkpoints, workspace
from grader.notebook.bench import bench
from grader.notebook.feedback import Answer, Checked, Note
from grader.notebook.file_backups import FileBackups
from grader.notebook.workspace import NOTEBOOK, VARIABLE, Workspace, course
from grader.words import say

from . import graph_view
from .signs import SIGNS

FOLDER, _NOTE = "clinic", "patient"
_PATIENCE_S = 60.0  # wall time for a node to come up; on a free machine it takes one or two seconds
_OWN = {"/rosout", "/parameter_events"}  # topics that every node has


def admit(case: str, *, fresh: bool = False) -> None:
    """Lay out a patient in ws/clinic and go there; one that was treated before comes back as it was left, or `fresh`.

    Raises:
        ValueError: there is no such case.
    """
    if case not in SIGNS:
        raise ValueError(say("There is no case {case!r}; there are {known}.", case=case, known=", ".join(SIGNS)))
    try:
        ill = checkpoints.patient(case)
    except GraderError as error:
        print(say("admit({case!r}): {error}", case=case, error=error))
        return
    root = workspace.find().root
    root = root if root.name == FOLDER else root / FOLDER
    workspace.ignored_by_colcon(root / "treated")
    table, note = Workspace(root).package, root / _NOTE
    if table.exists():
        left = root / "treated" / note.read_text()
        shutil.rmtree(left, ignore_errors=True)
        shutil.move(table, left)
    back = root / "treated" / case
    kept = back.exists() and not fresh
    if kept:
        table.parent.mkdir(exist_ok=True)
        shutil.move(back, table)
    else:
        checkpoints.write_files(table, ill["files"])
    note.write_text(case)
    os.environ[VARIABLE] = str(root)
    opened = workspace.open_workspace(os.environ.get(NOTEBOOK, ""))
    _install(opened, ill["installed"])
    workspace.prepare(opened, os.environ)
    FileBackups(opened).note_laid_out(dict.fromkeys(ill["files"], ""))
    cell_hooks.install(opened)
    where = f"ws/{FOLDER}/{table.relative_to(root)}"
    how = say("back as you left it") if kept else say("laid out")
    print(say("{case} is {kept} in {where}. Cells now work in that folder.", case=case, kept=how, where=where))


def check(case: str, diagnosis: str = "") -> Checked:
    """Judge the diagnosis ("FILE:LINE") of the patient on the table, and run it to see whether it is cured."""
    opened = workspace.find()
    if not (opened.root / _NOTE).is_file() or (opened.root / _NOTE).read_text() != case:
        seen = say("{case} is not on the table", case=case)
        note = _note("", seen, try_=say('run the cell with admit("{case}")', case=case))
        return Checked((Answer(case, "", "0", "", False, notes=(note,)),))
    ill = checkpoints.patient(case)
    notes = _judge(diagnosis.strip(), ill["where"])
    if not diagnosis and not _changed(opened, ill):
        notes.append(_note(say("cure"), say("the package is as it came in")))
    else:
        patient = SimpleNamespace(name=course().package, bench=_bench, launched=launched, run=partial(_run, opened))
        signs = [sign for sign in SIGNS[case](patient) if not sign[0]]
        notes += [_note(say("cure"), seen, expected, look) for _, seen, expected, look in signs]
    return Checked((Answer(case, say("diagnosis and cure"), "0", "", not notes, notes=tuple(notes)),))


def _note(head: str, seen: str, expected: str = "", try_: str = "") -> Note:
    rows = ((say("seen"), seen), (say("expected"), expected), (say("try"), try_))
    return Note(head, tuple(row for row in rows if row[1]))


def _judge(diagnosis: str, where: list[tuple[str, int, int]]) -> list[Note]:
    """Return what is wrong with a diagnosis, [] if it names a line of the fault."""
    path, _, line = diagnosis.rpartition(":")
    path = path.removeprefix(f"{Path.cwd()}/").removeprefix("./")
    if not path or not line.isdecimal():
        seen = diagnosis or say("no diagnosis")
        return [_note(say("diagnosis"), seen, expected=say("FILE:LINE, such as driver.py:12"))]
    places = [place for place in where if _same_file(path, place[0])]
    if any(first <= int(line) <= last for _, first, last in places):
        return []
    seen = say("nothing there explains the complaint")
    seen = say("the right file, and a line that does what it should") if places else seen
    try_ = say("read what the tools say once more: which value, name or time is wrong first?")
    return [_note(say("diagnosis"), seen, try_=try_)]


def _same_file(said: str, path: str) -> bool:
    """Return whether a path, or the end of one, is that of a file. A traceback has that of the link to it."""
    if "site-packages/" in path and "site-packages/" not in said:
        return False
    return f"/{said}".endswith(f"/{path}") or f"/{path}".endswith(f"/{said}")


def _changed(opened: Workspace, ill: dict[str, Any]) -> bool:
    """Return whether the patient, or what is installed of it, is not as it came in."""
    site = opened.install / ros_env.SITE_IN_PREFIX
    texts = {opened.package / path: text for path, text in ill["files"].items()}
    texts |= {site / path: text for path, text in ill["installed"].items()}
    return any(not path.is_file() or path.read_text(encoding="utf-8") != text for path, text in texts.items())


def _install(opened: Workspace, old: dict[str, str]) -> None:
    """Make an install tree of links, as `colcon build --symlink-install` does; of copies with `old` texts if any."""
    for made in ("build", "install"):
        shutil.rmtree(opened.root / made, ignore_errors=True)
    shutil.copytree(building.build_contract(building.cache_folder(), course()).install, opened.install)
    site, share = opened.install / ros_env.SITE_IN_PREFIX, opened.install / "share" / course().package
    places = {course().package: site, "launch": share, "config": share, "scripts": opened.install / "lib"}
    for path in sorted(opened.package.rglob("*")):
        name = path.relative_to(opened.package)
        if path.is_file() and name.parts[0] in places and path.suffix != ".pyc":
            target = places[name.parts[0]] / (Path(course().package, name.name) if name.parts[0] == "scripts" else name)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.unlink(missing_ok=True)
            if old:
                shutil.copy(path, target)
            else:
                target.symlink_to(path)
    yesterday = time.time() - 86400.0  # written in one second, Python's byte code of the one would count for the other
    for changed, text in old.items():
        (site / changed).write_text(text, encoding="utf-8")
        os.utime(site / changed, (yesterday, yesterday))
    (opened.root / workspace.LINKED).touch()


def _run(opened: Workspace, world: str = "open_field") -> Any:
    from grader.notebook import session

    return session.start(opened, next(iter(course().nodes)), world)


def _bench(name: str) -> Any:
    """Return a node of the patient on a bench; its log, which has the time of day, stays out of the answer."""
    from rclpy.impl.logging_severity import LoggingSeverity
    from rclpy.logging import set_logger_level

    set_logger_level(next(iter(course().nodes)), LoggingSeverity.ERROR)
    return bench(name)


@contextmanager
def launched(*words: str, nodes: int) -> Iterator[Any]:
    """Run `ros2 WORDS` until the block ends; begin when so many nodes are on the graph, or the command has ended."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.parameter import parameter_value_to_python
    from rclpy.parameter_client import AsyncParameterClient

    with graph_view.watcher() as watcher:
        executor = SingleThreadedExecutor(context=watcher.context)
        command = subprocess.Popen(
            ["ros2", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )

        def found() -> list[str]:
            return graph_view.names(watcher)

        def wait(until: Callable[[], bool]) -> None:
            end = time.monotonic() + _PATIENCE_S
            while not until() and command.poll() is None and time.monotonic() < end:
                time.sleep(0.05)

        def published(name: str, space: str, *, count: int) -> list[str]:
            def topics() -> set[str]:
                if f"{space.rstrip('/')}/{name}" not in found():
                    return set()
                return {topic for topic, _ in watcher.get_publisher_names_and_types_by_node(name, space)} - _OWN

            wait(lambda: len(topics()) >= count)  # a node is on the graph before it has made its publishers
            return sorted(topics())

        def parameter(node: str, name: str) -> str:
            client = AsyncParameterClient(watcher, node)
            if node not in found() or not client.wait_for_services(timeout_sec=_PATIENCE_S):
                return ""
            future = client.get_parameters([name])
            rclpy.spin_until_future_complete(watcher, future, executor, timeout_sec=_PATIENCE_S)
            answer = future.result()
            return str(parameter_value_to_python(answer.values[0])) if answer else ""

        try:
            wait(lambda: len(found()) >= nodes)
            yield SimpleNamespace(nodes=found, published=published, parameter=parameter)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(command.pid, signal.SIGINT)  # to all of its group, as Ctrl-C in a terminal
            with suppress(subprocess.TimeoutExpired):
                command.wait(_PATIENCE_S)
            with suppress(ProcessLookupError):
                os.killpg(command.pid, signal.SIGKILL)
