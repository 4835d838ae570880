"""Find where a package's files give it its name, for the student who has to rename it. Runs nothing."""

from __future__ import annotations

import re
from pathlib import Path

from grader.build.install_tree import regular_files
from grader.sandbox import untrusted
from grader.sanitize import printable

# The name may also be that of a node, an executable or a module, so only places where it must be the package's count.
_PLACES = (
    r"<name>\s*{name}\s*</name>|\bproject\s*\(\s*{name}\b|\b(?:lib|share|resource)/{name}\b|\b{name}/(?:msg|srv|action)/|"
    r"^\s*(?:from|import)\s+{name}\b|\b{name}\.\w+(?:\.\w+)*:\w+|\bpackage(?:_name)?\s*=\s*['\"]{name}['\"]|"
    r"\b(?:get_package_\w+|FindPackage\w+)\(\s*['\"]{name}['\"]"
)
_IN_SETUP_PY = r"|^\s*(?:name|NAME)\s*=\s*['\"]{name}['\"]"
_TEXTS = (".xml", ".txt", ".py", ".cfg", ".toml", "")
_FIRST = ("package.xml", "CMakeLists.txt", "setup.py", "setup.cfg")
_MAX_BYTES = 200_000
_MAX_PLACES = 100


def places(package: Path, name: str) -> list[str]:
    """Return the files of a package that give it its name, as "setup.py:6" with the line; "setup.py" for their path."""
    found = []
    for path in sorted(regular_files(package), key=lambda path: _order(path.relative_to(package).as_posix())):
        file = path.relative_to(package).as_posix()
        if name in Path(file).parts:
            found.append(printable(file))
        elif path.suffix in _TEXTS:
            pattern = _PLACES + (_IN_SETUP_PY if path.name == "setup.py" else "")
            named = re.compile(pattern.replace("{name}", re.escape(name)))
            lines = (untrusted.read_text(path, _MAX_BYTES, errors="replace") or "").splitlines()
            found += [f"{printable(file)}:{n}" for n, line in enumerate(lines, 1) if named.search(line[:500])]
    return found[:_MAX_PLACES]


def _order(file: str) -> tuple[int, str]:
    return (_FIRST.index(file) if file in _FIRST else len(_FIRST)), file
