"""Find where a package's files give it its name, for the student who has to rename it. Runs nothing."""

from __future__ import annotations

import re
from pathlib import Path

from grader.building.install_tree import regular_files
from grader.sandbox import untrusted
from grader.sanitize import printable

# The name may also be that of a node, an executable or a module, so only places where it must be the package's count.
_PLACES = (
    r"<name>\s*{name}\s*</name>|\bproject\s*\(\s*{name}\b|\b(?:lib|share|resource)/{name}\b|\b{name}/(?:msg|srv|action)/|"
    r"^\s*(?:from|import)\s+{name}\b|\b{name}\.\w+(?:\.\w+)*:\w+|\b(?:pkg|package(?:_name)?)\s*=\s*['\"]{name}['\"]|"
    r"\bpackage://{name}/|\$\(find-pkg-share {name}\)|"
    r"\b(?:get_package_\w+|FindPackage\w+)\(\s*['\"]{name}['\"]"
)
_IN_SETUP_PY = r"|^\s*(?:name|NAME|packages)\s*=\s*\[?['\"]{name}['\"]|^\s*packages\s*=.*['\"]{name}['\"]"
_TEXTS = (".xml", ".txt", ".py", ".cfg", ".toml", "")
_RESULTS = "test_results.xml"
_FIRST = ("package.xml", "CMakeLists.txt", "setup.py", "setup.cfg")
_MAX_BYTES = 200_000
_MAX_PLACES = 100


def places(package: Path, name: str) -> list[str]:
    """Return where a package's files give it its name, as "setup.py:6".

    A folder that has the name is "name/", and the file that marks the package "resource/name".
    """
    found = [place for place in (f"{name}/", f"resource/{name}") if (package / place).exists()]
    for path in sorted(regular_files(package)):
        file = path.relative_to(package).as_posix()
        if path.suffix in _TEXTS and path.name != _RESULTS:
            pattern = _PLACES + (_IN_SETUP_PY if path.name == "setup.py" else "")
            named = re.compile(pattern.replace("{name}", re.escape(name)))
            lines = (untrusted.read_text(path, _MAX_BYTES, errors="replace") or "").splitlines()
            found += [f"{printable(file)}:{n}" for n, line in enumerate(lines, 1) if named.search(line[:500])]
    return sorted(found, key=lambda place: _rank(place.partition(":")[0]))[:_MAX_PLACES]


def _rank(file: str) -> int:
    """Return a file's place in the list: first what ROS reads, then folders, then code."""
    return _FIRST.index(file) if file in _FIRST else len(_FIRST) + (not file.endswith("/"))
