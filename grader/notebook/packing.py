"""Pack a package for handing in, and say what the grader will see of it: files, sizes, points, what is not own work."""

from __future__ import annotations

import json
import os
import posixpath
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from grader import build, pipeline
from grader.contract import spec
from grader.errors import KitError, SubmissionError
from grader.evidence import Flag
from grader.intake.plan import BUILD_MARKERS, BUILD_NAMES, VENV_MARKER, Limits
from grader.intake.submission import open_submission
from grader.notebook import checkpoints, workspace
from grader.scoring import rubric
from grader.scoring.grading import Grading, points
from grader.scoring.rubric import RUBRIC
from grader.scoring.scorecard import Outcome

NEEDED = (
    "package.xml",
    "CMakeLists.txt",
    f"{spec.PACKAGE}/robot_controller.py",
    f"{spec.PACKAGE}/sensor_processor.py",
)
_CACHES = {"__pycache__", "htmlcov", "node_modules"}
_KEPT_DOTS = {checkpoints.MARKER, ".flake8", ".coveragerc", ".gitignore"}
_EPOCH = (1980, 1, 1, 0, 0, 0)  # one date for all: the same package gives the same bytes
_LISTED = 40


@dataclass(frozen=True)
class HandedIn:
    """A packed submission. `sizes` has each file's bytes; `laid_out` are those that the course, not you, wrote."""

    archive: Path
    sizes: dict[str, int]
    laid_out: tuple[str, ...]
    missing: tuple[str, ...]
    notes: tuple[str, ...]
    flags: tuple[Flag, ...] = ()
    grading: Grading | None = None

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        return str(self)

    def lines(self) -> Iterator[str]:
        """Give the account, line by line."""
        total = sum(self.sizes.values())
        yield f"{self.archive.name}: {_count(len(self.sizes), 'file')}, {_size(total)}"
        for name, size in list(self.sizes.items())[:_LISTED]:
            mark = "   laid out by the course" if name in self.laid_out else ""
            yield f"  {_size(size):>8}  {name}{mark}"
        if len(self.sizes) > _LISTED:
            yield f"            and {len(self.sizes) - _LISTED} more"
        for name in self.missing:
            yield f"missing: {name}"
        for note in self.notes:
            yield f"note: {note}"
        for flag in self.flags:
            yield f"an instructor will look at this: {flag.what}"
        if self.laid_out:
            yield f"{len(self.laid_out)} of {len(self.sizes)} files were laid out by the course: not your own work."
        yield from self._graded()

    def _graded(self) -> Iterator[str]:
        if self.grading is None:
            yield "Nothing was checked. `grader submit` without --no-check says what the public checks give."
            return
        card = self.grading.scorecard
        yield "The public checks give:"
        for criterion in card.criteria:
            yield f"  {criterion.criterion.title:<20} {points(criterion.points):>5} of {points(criterion.max)}"
        total, worth = sum(c.points for c in card.criteria), sum(c.max for c in card.criteria)
        yield f"  {'Together':<20} {points(total):>5} of {points(worth)}"
        lost = [s.requirement.id for s in card.requirements if s.outcome not in (Outcome.PASSED, Outcome.NOT_GRADED)]
        if lost:
            yield f"  points are lost in {', '.join(lost)}; `check(...)` in the notebook says why"
        yield "Your instructor's grading uses other speeds, places and seeds, so it can differ."


def submit(
    package: Path | None = None,
    out: Path | None = None,
    *,
    check: bool = True,
    progress: Callable[[str], None] = lambda _what: None,
) -> HandedIn:
    """Pack `package` (default: the workspace's) as the zip `out` (default: beside the workspace's src) and look at it.

    With `check` the public checks run on the archive itself, as the grader will find it: a few minutes.

    Raises:
        SubmissionError: there is no package to hand in, or it is too large.
        GraderError: this host cannot check.
    """
    package = (package or _workspace_package()).resolve()
    if not (package / "package.xml").is_file():
        raise SubmissionError(
            f"There is nothing to hand in: {package.name} holds no package.xml. "
            "Notebook 01 makes one; `--package` names another folder."
        )
    target = (out or _beside(package) / f"{spec.PACKAGE}.zip").resolve()
    sizes = _pack(package, target)
    with tempfile.TemporaryDirectory(prefix="submit-") as scratch:
        taken = open_submission(target, Path(scratch) / "submission")
        found = HandedIn(
            target,
            sizes,
            laid_out=tuple(laid_out(package, sizes)),
            missing=tuple(name for name in NEEDED if name not in sizes),
            notes=tuple(taken.intake.notes),
            flags=taken.flags,
        )
        if not check:
            return found
        settings = pipeline.Settings(rubric.load(RUBRIC), build.cache_folder(), progress=progress)
        graded = pipeline.grade(target, Path(scratch) / "out", settings)
    return replace(found, grading=graded)


def _workspace_package() -> Path:
    """Return the present folder's package, else the workspace's."""
    here = Path.cwd()
    return here if (here / "package.xml").is_file() else workspace.find().package


def _beside(package: Path) -> Path:
    """Return the folder for the archive: the workspace, or what holds the package. Never the package itself."""
    return package.parent.parent if package.parent.name == "src" else package.parent


def _pack(package: Path, target: Path) -> dict[str, int]:
    """Write the package's own files into the zip, below one folder, and return their sizes."""
    files = {path.relative_to(package).as_posix(): path for path in sorted(_own_files(package))}
    interfaces = package.with_name(spec.INTERFACES_PACKAGE)
    if (interfaces / "package.xml").is_file():  # split off, which the grader takes too
        files |= {f"../{path.relative_to(package.parent).as_posix()}": path for path in sorted(_own_files(interfaces))}
    _refuse_large(files)
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(target.name + ".part")
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for name, path in files.items():
                entry = zipfile.ZipInfo(posixpath.normpath(f"{spec.PACKAGE}/{name}"), _EPOCH)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = (0o100755 if os.access(path, os.X_OK) else 0o100644) << 16
                archive.writestr(entry, path.read_bytes())
        part.replace(target)
    except OSError as error:
        raise KitError(f"Cannot write {target.name}: {error}. Name another place with --out.") from error
    finally:
        part.unlink(missing_ok=True)
    return {name: path.stat().st_size for name, path in files.items()}


def _own_files(folder: Path) -> Iterator[Path]:
    """Give the files of the package, without build trees, caches, environments and version control."""
    for path in folder.iterdir():
        if path.is_symlink() or path.suffix in (".pyc", ".zip"):
            continue
        if path.is_file():
            if not path.name.startswith(".") or path.name in _KEPT_DOTS:
                yield path
        elif path.is_dir() and not _made(path):
            yield from _own_files(path)


def _made(folder: Path) -> bool:
    """Return whether a tool made the folder. A student's own `log` stays: a build tree has a marker in it."""
    if folder.name.startswith(".") or folder.name in _CACHES or folder.name.endswith(".egg-info"):
        return True
    held = {path.name for path in folder.iterdir()}
    return VENV_MARKER in held or (folder.name in BUILD_NAMES and bool(held & BUILD_MARKERS))


def _refuse_large(files: dict[str, Path]) -> None:
    limits = Limits()
    sizes = {name: path.stat().st_size for name, path in files.items()}
    if sum(sizes.values()) > limits.total_bytes or len(sizes) > limits.files:
        largest = max(sizes, key=lambda name: sizes[name])
        raise SubmissionError(
            f"The package has {len(sizes)} files and {_size(sum(sizes.values()))}, more than the grader takes in. "
            f"The largest is {largest} with {_size(sizes[largest])}; move what is no source out of the package."
        )


def laid_out(package: Path, names: dict[str, int]) -> list[str]:
    """Return the files that are still as `start_at` laid them out."""
    try:
        sums = json.loads((package / checkpoints.MARKER).read_text())["sha256"]
        return [name for name in names if sums.get(name) == checkpoints.sha256((package / name).read_bytes())]
    except (OSError, ValueError, KeyError, AttributeError, TypeError):
        return []


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _size(size: int) -> str:
    return f"{size} B" if size < 1000 else f"{size / 1000:.1f} kB" if size < 1_000_000 else f"{size / 1e6:.1f} MB"
