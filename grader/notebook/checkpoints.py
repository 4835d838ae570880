"""The stages of the package: which files each notebook adds, and what they hold at that stage.

The solutions live once, in solution_pkg. A stage takes a file as it is there, with the edits of drafts.py where it is
not so far yet, or a text of given.py. A kit for students has no solution_pkg; there the stages come from a packed file,
if the instructor has put one in.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from grader import KIT
from grader.authoring import starter_files
from grader.contract.spec import PACKAGE
from grader.errors import GraderError
from grader.intake import course_marker
from grader.notebook.workspace import Workspace, ignored_by_colcon

REFERENCE = KIT / "solution_pkg" / PACKAGE
PACKED = Path(__file__).parent / "checkpoints.bin"
MARKER = course_marker.MARKER
"""The file in the package that says what was laid out, and is not the student's own work."""

NOTEBOOKS = (
    "00_first_drive", "01_anatomy", "02_interfaces", "03_numbers_of_motion", "04_seeing", "05_moving_safely",
    "06_services", "07_going_there", "08_settings_and_launch", "09_tests_that_notice", "10_show_and_hand_in",
)  # fmt: skip


@dataclass(frozen=True)
class Version:
    """What a file holds at a stage: the reference's text after the edits `draft`, or a `text` of the course's own."""

    draft: str = ""
    text: str | None = None

    @property
    def final(self) -> bool:
        """Return whether this is the file as the reference has it."""
        return not self.draft and self.text is None


@dataclass(frozen=True)
class Stage:
    """What one notebook adds or replaces: `exercises` are written by the student, `given` by the course.

    `made` are files that a command of the notebook writes.
    """

    exercises: Mapping[str, Version]
    given: Mapping[str, Version]
    made: Mapping[str, Version]


FINAL = Version()
_P = PACKAGE


def _of(text: str) -> Version:
    return Version(text=text)


def _final(*paths: str) -> dict[str, Version]:
    return dict.fromkeys(paths, FINAL)


# Notebook -> (exercises, given, made by a command). The tests of notebook 09 are those of the reference.
_TABLE: dict[str, tuple[dict[str, Version], dict[str, Version], dict[str, Version]]] = {
    "00": ({}, {}, {}),
    "01": (
        {
            "package.xml": Version(draft="only rclpy yet"),
            "CMakeLists.txt": Version(draft="no interfaces yet"),
            "scripts/robot_controller": FINAL,
        },
        {
            **_final("setup.py", "setup.cfg", f"{_P}/__init__.py", f"{_P}/utils/__init__.py"),
            f"{_P}/utils/running.py": _of(starter_files.RUNNING_01),
            "scripts/sensor_processor": FINAL,
            f"{_P}/robot_controller.py": _of(starter_files.ROBOT_CONTROLLER_01),
            f"{_P}/sensor_processor.py": _of(starter_files.SENSOR_PROCESSOR_01),
        },
        {},
    ),
    "02": (
        _final(
            "msg/SensorFusionData.msg", "srv/SetSpeed.srv", "srv/GetRobotStatus.srv",
            "action/NavigateToPosition.action", "CMakeLists.txt", "package.xml",
        ),
        {},
        {},
    ),
    "03": (_final(f"{_P}/utils/conversions.py"), {}, {}),
    "04": (
        _final(f"{_P}/utils/scans.py", f"{_P}/sensor_processor.py"),
        {f"{_P}/utils/settings.py": _of(starter_files.SETTINGS_04)},
        {},
    ),
    "05": (
        _final(f"{_P}/utils/motion.py", f"{_P}/driver.py", f"{_P}/utils/running.py"),
        {f"{_P}/robot_controller.py": _of(starter_files.ROBOT_CONTROLLER_05)},
        {},
    ),
    "06": (
        _final(f"{_P}/speed_server.py"),
        {f"{_P}/robot_controller.py": _of(starter_files.ROBOT_CONTROLLER_06)},
        {},
    ),
    "07": (
        _final(f"{_P}/utils/steering.py", f"{_P}/navigator.py"),
        {f"{_P}/robot_controller.py": _of(starter_files.ROBOT_CONTROLLER_07)},
        {},
    ),
    "08": (
        _final(
            f"{_P}/utils/settings.py", f"{_P}/robot_controller.py", "config/robot_params.yaml",
            "config/sensor_params.yaml", "launch/robot_controller_launch.py", "launch/sensor_processor_launch.py",
        ),
        {},
        {},
    ),
    "09": (
        _final("test/test_robot_controller.py", "test/test_sensor_processor.py"),
        _final("test/conftest.py"),
        {},
    ),
    "10": (_final("scripts/demo.py", "README.md"), _final("LICENSE"), _final("test_results.xml")),
}  # fmt: skip


def number(notebook: str) -> str:
    """Return "05" for "05" or "05_moving_safely".

    Raises:
        ValueError: the course has no such notebook.
    """
    found = notebook[:2]
    if found not in _TABLE:
        raise ValueError(f"There is no notebook {notebook!r}; there are {', '.join(NOTEBOOKS)}.")
    return found


def stage(notebook: str) -> Stage:
    """Return what a notebook ("05") adds or replaces."""
    key = number(notebook)
    exercises, given_files, made = _TABLE[key]
    if key == "09":
        exercises = exercises | {path: FINAL for path in _reference_tests() if path not in given_files}
    return Stage(exercises, given_files, made)


def written_in(path: str) -> str:
    """Return the first notebook ("05") that writes a file of the package, "" if none does."""
    for key in _TABLE:
        found = stage(key)
        if path in found.exercises or path in found.given or path in found.made:
            return key
    return ""


def paths_before(notebook: str) -> list[str]:
    """Return the files that the notebooks before this one leave; known without the solutions."""
    paths: dict[str, None] = {}
    for key in _TABLE:
        if key < number(notebook):
            found = stage(key)
            paths |= dict.fromkeys([*found.given, *found.exercises, *found.made])
    return list(paths)


def files_after(notebook: str) -> dict[str, str]:
    """Return the text of every file of the package as it is when a notebook ("05") has been done.

    Raises:
        GraderError: this kit has no solutions.
    """
    files: dict[str, str] = {}
    for key in _TABLE:
        if key <= number(notebook):
            found = _texts(key)
            files |= found["given"] | found["exercises"] | found["made"]
    return files


def exercise(notebook: str, path: str) -> str:
    """Return the solution of an exercise: the text of the file that the notebook asks for.

    Raises:
        GraderError: this kit has no solutions. KeyError: the notebook has no such exercise.
    """
    return _texts(number(notebook))["exercises"][path]


def given_text(notebook: str, path: str) -> str:
    """Return the text of a file that the notebook gives.

    Raises:
        GraderError: this kit has no solutions. KeyError: the notebook gives no such file.
    """
    return _texts(number(notebook))["given"][path]


def pack() -> bytes:
    """Return every stage's texts as one compressed JSON document, for a kit without solution_pkg."""
    return zlib.compress(json.dumps({key: _texts(key) for key in _TABLE}).encode(), level=9)


def start_at(workspace: Workspace, notebook: str) -> str:
    """Lay out the package as the notebooks before `notebook` leave it, and return in words what was done.

    What is in the package is moved to a backup in the workspace.
    """
    key = number(notebook)
    try:
        files = files_after(f"{int(key) - 1:02}") if key > "00" else {}
    except GraderError as error:
        return f"start_at({key!r}): {error}"
    package = workspace.package
    package.mkdir(parents=True, exist_ok=True)
    kept = _back_up(workspace)
    for path, text in files.items():
        target = package / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
        if text.startswith("#!"):
            target.chmod(0o755)
    own = _exercises_before(key)
    if own:
        # What the course gives to everybody is nobody's own work, and not worth a note.
        sums = {path: sha256(files[path].encode()) for path in sorted(own)}
        (package / MARKER).write_text(json.dumps({"laid_out_before": key, "sha256": sums}, indent=1) + "\n")
    words = f"Your package holds now what the notebooks before {key} leave: {len(files)} files, laid out by the course."
    return f"{words} What was there is in {workspace.shown(kept)}." if kept else words


def _exercises_before(key: str) -> set[str]:
    """Return the files that are a student's work in the notebooks before this one, and still are at its beginning."""
    own: set[str] = set()
    for earlier in (other for other in _TABLE if other < key):
        texts = _texts(earlier)
        own = (own | set(texts["exercises"]) | set(texts["made"])) - set(texts["given"])
    return own


def sha256(content: bytes) -> str:
    """Return a file's checksum as the marker has it."""
    return hashlib.sha256(content).hexdigest()


# -- inside -----------------------------------------------------------------------------------------------------------


def _texts(key: str) -> dict[str, dict[str, str]]:
    if not REFERENCE.is_dir():
        return _packed()[key]
    found = stage(key)
    return {
        kind: {path: _text(path, version) for path, version in versions.items()}
        for kind, versions in (("exercises", found.exercises), ("given", found.given), ("made", found.made))
    }


def _text(path: str, version: Version) -> str:
    if version.text is not None:
        return version.text
    text = (REFERENCE / path).read_text(encoding="utf-8")
    if not version.draft:
        return text
    from grader.authoring import reference_edits  # not in a students' kit: its edits hold parts of the solutions

    return reference_edits.apply(version.draft, text)


@cache
def _packed() -> dict[str, dict[str, dict[str, str]]]:
    try:
        found: dict[str, dict[str, dict[str, str]]] = json.loads(zlib.decompress(PACKED.read_bytes()))
    except (OSError, ValueError, zlib.error):
        raise GraderError("this kit holds no solutions to lay out; your instructor has left them out.") from None
    return found


def _reference_tests() -> list[str]:
    if REFERENCE.is_dir():
        return [f"test/{path.name}" for path in sorted((REFERENCE / "test").glob("test_*.py"))]
    return [path for path in _packed()["09"]["exercises"] if path.startswith("test/")] if PACKED.is_file() else []


def _back_up(workspace: Workspace) -> Path | None:
    """Move what is in the package to a fresh folder beside src, and return that; None if there is nothing."""
    there = [path for path in workspace.package.iterdir() if path.name != "__pycache__"]
    if not there:
        return None
    number = 1
    while (backup := workspace.root / f"backup-{number}").exists():
        number += 1
    ignored_by_colcon(backup)  # it holds a package.xml, and colcon refuses two packages of one name
    for path in there:
        shutil.move(path, backup / path.name)
    return backup
