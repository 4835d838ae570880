"""Lay out a new course: a copy of the small one beside this file, or of the kit's own, or changes of the kit's own."""

from __future__ import annotations

import importlib.util
import io
import keyword
import re
import shutil
import tempfile
import tokenize
from pathlib import Path

from grader import KIT
from grader.course import Course, kits_own, load
from grader.course.reader import CONTRACT
from grader.errors import UsageError

_TEMPLATE = Path(__file__).parent / "template_course"
_CHANGES = Path(__file__).parent / "template_changes"
_NOT_COPIED = shutil.ignore_patterns("__pycache__", ".*", "published", "ws", "build", "install", "log")
_NAME = re.compile(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)*")
_MOST = 40  # letters of a name
_LINE = 99  # characters that ament_flake8 takes
_IMPORTS = re.compile(r"(?:^(?:import|from) .*\n)+", re.MULTILINE)


def lay_out(folder: Path, package: str = "", *, node: str = "", service: str = "") -> Course:
    """Copy the small course to `folder`, with other names for its parts where they are not "", and return it.

    Raises:
        UsageError: there is something in the folder, or a name is not one for such a part.
    """
    _require_empty(folder)
    sample = load(_TEMPLATE)
    (guard,) = sample.nodes.values()
    (patrol,) = guard.services
    names = _Names((sample.package, package), (guard.name, node), (patrol, service))
    names.require_good()
    with tempfile.TemporaryDirectory(prefix="new-course-") as scratch:
        made = Path(shutil.copytree(_TEMPLATE, Path(scratch) / "course", ignore=_NOT_COPIED))
        if names.changed:
            names.rename(made)
        shutil.copytree(made, folder, dirs_exist_ok=True)
    return load(folder)


def extend_kits_own(folder: Path) -> Course:
    """Lay out a course in `folder` that keeps the kit's own and changes some of it, and return it.

    Raises:
        UsageError: there is something in the folder.
    """
    _require_empty(folder)
    shutil.copytree(_CHANGES, folder, ignore=_NOT_COPIED, dirs_exist_ok=True)
    return load(folder)


def copy_kits_own(folder: Path) -> Course:
    """Copy the kit's own course to `folder`, with its rubric, solution and notebooks, and return it.

    Raises:
        UsageError: there is something in the folder.
    """
    _require_empty(folder)
    course = kits_own()
    shutil.copytree(course.folder, folder, ignore=_NOT_COPIED, dirs_exist_ok=True)
    shutil.copy(course.rubric, folder)
    solution = folder / course.solution.parent.name / course.solution.name
    shutil.copytree(course.solution, solution, ignore=_NOT_COPIED)
    shutil.copytree(course.notebooks, folder / course.notebooks.name, ignore=_NOT_COPIED)
    places = {"rubric": folder / course.rubric.name, "solution": solution, "notebooks": folder / course.notebooks.name}
    text = (folder / "course.yaml").read_text(encoding="utf-8")
    for key, path in places.items():
        text = re.sub(rf"(?m)^{key}: .*", f"{key}: {path.relative_to(folder).as_posix()}", text)
    (folder / "course.yaml").write_text(text, encoding="utf-8")
    frame = folder / "handout.md.j2"
    name = course.folder.relative_to(KIT).as_posix()
    frame.write_text(frame.read_text(encoding="utf-8").replace(f"{name}/", ""), encoding="utf-8")
    return load(folder)


def _require_empty(folder: Path) -> None:
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder} is not an empty folder; nothing was written.", "Choose a new one.")


class _Names:
    """The old and the new names of the small course's package, node and service."""

    def __init__(self, package: tuple[str, str], node: tuple[str, str], service: tuple[str, str]) -> None:
        parts = {"package": package, "node": node, "service": service}
        self.changed = {part: (old, new) for part, (old, new) in parts.items() if new and new != old}
        # Also where it stays: the node's name is a part of it.
        self._words = {package[0]: package[1] or package[0]}
        if "node" in self.changed:
            old, new = node
            spoken = new.replace("_", " ")
            self._words |= {
                rf"(?<=\b[Tt]he ){old}\b": spoken,
                rf"\bA {old}\b": f"{'An' if new[0] in 'aeiou' else 'A'} {spoken}",
                rf"(?<![^\W_]){old}\b": new,  # in test_guard and 01_guard, too
                rf"\b{_class(old)}\b": _class(new),
            }
        if "service" in self.changed:
            old, new = service
            self._words[rf"(?<=[`'\"/]){old}(?=[`'\"\s])|(?<=run\.){old}\b|\b{old}(?=: std_srvs/)"] = new

    def require_good(self) -> None:
        """Refuse a new name that ROS or Python would not take, or that the small course has for something else.

        Raises:
            UsageError: it says which name, and why.
        """
        taken = _identifiers(_TEMPLATE) if self.changed.keys() - {"package"} else frozenset()
        for part, (_, new) in self.changed.items():
            why = ""
            if not _NAME.fullmatch(new) or keyword.iskeyword(new) or len(new) > _MOST:
                why = f"is no name for a {part}: small letters, digits and single underscores, {_MOST} at most"
            elif part == "package" and importlib.util.find_spec(new):
                why = "is the name of a Python module that is installed here, which the package would hide"
            elif part != "package" and taken & {new, _class(new)}:
                why = "is a name that the small course uses for something else"
            if why:
                raise UsageError(f"{new} {why}.", f"Choose another --{part}.")

    def rename(self, folder: Path) -> None:
        """Replace the names in every file, and in the names of files and folders; imports are sorted again.

        Raises:
            UsageError: a line of the solution gets too long.
        """
        found = re.compile("|".join(f"({old})" for old in self._words))
        new = [*self._words.values()]

        def replaced(text: str) -> str:
            return found.sub(lambda match: new[(match.lastindex or 1) - 1], text)

        for path in sorted(folder.rglob("*"), reverse=True):  # what is in a folder comes before it
            if path.is_file():
                text = replaced(path.read_text(encoding="utf-8"))
                text = _IMPORTS.sub(_sorted, text) if path.suffix == ".py" else text
                path.write_text(text, encoding="utf-8")
                longest = max(map(len, text.splitlines()), default=0) if path.suffix == ".py" else 0
                if longest > _LINE and "solution" in path.parts:
                    raise UsageError(
                        f"With these names a line of {path.name} has {longest} characters; ament_flake8 takes {_LINE}.",
                        "Choose shorter ones.",
                    )
            path.rename(path.with_name(replaced(path.name)))


def _class(node: str) -> str:
    """Return the name of a node's class: DoorOpener for door_opener."""
    return "".join(word.capitalize() for word in node.split("_"))


def _identifiers(folder: Path) -> frozenset[str]:
    """Return all names in the Python files of a folder, and all words of its contract."""
    found = set(re.findall(r"\w+", (folder / CONTRACT).read_text(encoding="utf-8")))
    for path in folder.rglob("*.py"):
        if "source" not in path.parts:  # of notebooks
            tokens = tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline)
            found |= {token.string for token in tokens if token.type == tokenize.NAME}
    return frozenset(found)


def _sorted(imports: re.Match[str]) -> str:
    """Return lines of imports in the order that ament_flake8 asks for: by the names of their modules, then of these."""
    lines = []
    for line in imports[0].splitlines(keepends=True):
        begin, word, names = line.partition(" import ")
        if word and "(" not in names and "#" not in names:
            line = begin + word + ", ".join(sorted(names.strip().split(", "), key=str.lower)) + "\n"
        lines.append(line)
    return "".join(sorted(lines, key=lambda line: line.split()[1].lower()))
