"""Write the kit for students: one zip with all that the course needs, and nothing of what only an instructor has.

What goes in is listed here by name, so that a new file is left out until somebody decides otherwise; only `grader` and
`sim` go in whole, but for the parts named in `_WITHHELD`.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader import KIT
from grader.errors import GraderError
from grader.notebook import checkpoints as course_stages

TOP = "ros2-course-kit"
_EPOCH = (1980, 1, 1, 0, 0, 0)  # one date for all: the same tree gives the same bytes
_STUDENT = KIT / "grader" / "authoring" / "student_kit"
_PAGES = ("handout", "live-view", "ros2-command", "ros2-session", "simulator", "launch", "ros-from-wheels", "setup")
# The tools with which instructors and authors make, attack and release the course.
_WITHHELD = ("grader/authoring/", "grader/selftest/")
_NO_SOURCE = ("__pycache__", ".pyc", ".ipynb_checkpoints")
_STAGES = f"grader/notebook/{course_stages.PACKED.name}"


@dataclass(frozen=True)
class Released:
    """A written kit: its files, below the top folder, and its size."""

    files: tuple[str, ...]
    bytes: int
    with_stages: bool

    @property
    def words(self) -> str:
        """Return what `start_at` can do in this kit."""
        if self.with_stages:
            return "with the packed solutions, so `start_at` works; --without-stages leaves them out"
        return "without the solutions, so `start_at` lays out nothing"


def release(out: Path, *, stages: bool = True) -> Released:
    """Write the students' kit to the zip `out`.

    Raises:
        GraderError: this is no checkout of the whole kit, or `out` cannot be written.
    """
    if not course_stages.REFERENCE.is_dir():
        raise GraderError("This is a students' kit; a kit is released from the whole one, which holds solution_pkg.")
    files = contents(stages=stages)
    part = out.with_name(out.name + ".part")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for name, data in sorted(files.items()):
                entry = zipfile.ZipInfo(f"{TOP}/{name}", _EPOCH)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = (0o100755 if data.startswith(b"#!") else 0o100644) << 16
                archive.writestr(entry, data)
        part.replace(out)
    except OSError as error:
        raise GraderError(f"The kit cannot be written to {out}: {error}. Choose another --out.") from error
    finally:
        part.unlink(missing_ok=True)
    return Released(tuple(sorted(files)), out.stat().st_size, stages)


def contents(*, stages: bool = True) -> dict[str, bytes]:
    """Return the files of the students' kit by their names."""
    found = {name: (KIT / name).read_bytes() for name in _named()}
    for path in sorted(_STUDENT.iterdir()):
        found[path.name] = path.read_bytes()
    found["pyproject.toml"] = packaging((KIT / "pyproject.toml").read_text()).encode()
    found["requirements.txt"] = pins((KIT / "requirements.txt").read_text()).encode()
    found.pop(_STAGES, None)
    if stages:
        found[_STAGES] = course_stages.pack()
    return found


def _named() -> Iterator[str]:
    yield from (".ci/setup", ".ci/setup.py", ".gitignore", "LICENSE", "rubric.yaml", "notebooks/README.md")
    for pattern in ("notebooks/[0-9][0-9]_*.ipynb", "notebooks/pictures/[0-9][0-9]*.png"):
        yield from (path.relative_to(KIT).as_posix() for path in KIT.glob(pattern))
    yield from (f"docs/{page}.md" for page in _PAGES)
    for top in ("grader", "sim"):
        for path in (KIT / top).rglob("*"):
            name = path.relative_to(KIT).as_posix()
            if path.is_file() and not name.startswith(_WITHHELD) and not any(part in name for part in _NO_SOURCE):
                yield name


def packaging(text: str) -> str:
    """Return pyproject.toml without what only developers use: the extra `dev`, the settings of linters and tests."""
    tables = re.split(r"(?m)^(?=\[)", text)
    kept = [t for t in tables if not t.lstrip("[").startswith("tool.") or t.startswith("[tool.setuptools")]
    return re.sub(r"(?m)^dev = .*\n", "", "".join(kept)).rstrip("\n") + "\n"


def pins(text: str) -> str:
    """Return requirements.txt without the packages that only the extra `dev` brings in.

    What brings a package in stands below it ("# via"); the kit's own wishes are those of pyproject.toml.
    """
    blocks = re.findall(r"(?m)^[a-z0-9].*\n(?:^ +#.*\n)*", text if text.endswith("\n") else text + "\n")
    wanted = _wanted()
    parents = {_name(block): set(re.findall(r"(?m)^ +#(?: via)? +([A-Za-z0-9._-]+)(?= |$)", block)) for block in blocks}
    kept = {name for name in parents if name in wanted}
    while more := {name for name, by in parents.items() if name not in kept and by & kept}:
        kept |= more
    return "".join(block for block in blocks if _name(block) in kept)


def _name(block: str) -> str:
    return re.split(r"[=\[ ;]", block, maxsplit=1)[0]


def _wanted() -> set[str]:
    import tomllib

    project = tomllib.loads((KIT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    wishes = [*project["dependencies"], *(w for extra, held in extras.items() if extra != "dev" for w in held)]
    # `make setup` builds the kit itself without fetching anything more.
    wishes += tomllib.loads((KIT / "pyproject.toml").read_text())["build-system"]["requires"]
    return {re.split(r"[\[<>=~! ]", wish, maxsplit=1)[0].lower().replace("_", "-") for wish in wishes}
