"""The packages of a league, in the course's folder held_back/league: `broken` ones to catch, and `right` ones.

Each is a folder with a package, or a file NAME.yaml with an edit of the solution: file, old, new.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from grader import building, yaml_reader
from grader.building import Built
from grader.course import Course
from grader.errors import GraderError
from grader.intake import package_edits
from grader.intake.package_edits import Edit
from grader.settings import Settings
from grader.yaml_reader import YamlReader

FOLDER = "league"
"""In the course's folder held_back."""


@dataclass(frozen=True)
class Package:
    """A package of a league: what is in the folder `base`, with an edit. `name` is "" for the solution itself."""

    name: str
    base: Path
    broken: bool
    edit: Edit | None = None

    @property
    def content(self) -> str:
        """Return a hash of all that it is made of."""
        return building.content_key([self.base], repr(self.edit))

    def built(self, folder: Path, settings: Settings) -> tuple[Path, Built, Built]:
        """Return it as made below `folder`, its build and that of the contract, each done once for its content.

        Raises:
            GraderError: it does not build.
        """
        package = self.edit.made(self.base, folder) if self.edit else package_edits.copy(self.base, folder)
        built = building.build([package], settings.cache, settings.course, seconds=settings.build_seconds)
        if not built.facts.ok:
            which = f"The package {self.name} of the league" if self.name else "The solution"
            raise GraderError(f"{which} does not build:\n{built.facts.log_tail[-1000:]}")
        return package, built, building.build_contract(settings.cache, settings.course, built.facts.types_package)


def read(course: Course) -> list[Package]:
    """Return the packages of a course's league, the right ones first, of these the solution; [] without a pool.

    Raises:
        GraderError: an edit does not fit the solution; file and line are named.
    """
    home = course.held_back / FOLDER
    if not home.is_dir() or not course.solution.is_dir():
        return []
    found = [Package("", course.solution, broken=False)]
    wrong: list[str] = []
    for kind in ("right", "broken"):
        for path in sorted((home / kind).glob("[!._]*")):
            with yaml_reader.noted(wrong):
                edit = None if path.is_dir() else _edit(path, course.solution)
                found.append(Package(path.name, course.solution if edit else path, kind == "broken", edit))
    yaml_reader.require_none(wrong)
    return found


def _edit(path: Path, solution: Path) -> Edit:
    reader, root = YamlReader(), yaml_reader.read(path)
    given = reader.fields(root, root, ("file", "old", "new"), "an edit of the solution")
    return package_edits.read(reader, given, solution)
