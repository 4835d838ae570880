"""Remove byte code from an install tree, so that Python compiles text, and find code that poses as generated types."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from grader.building.type_hashes import Generated
from grader.evidence import Flag
from grader.host import ros_env
from grader.sandbox import untrusted
from grader.sanitize import printable

_BYTE_CODE = (".pyc", ".pyo")
_TYPE_FOLDERS = ("msg", "srv", "action")
_MAX_LISTED = 50


def remove_byte_code(install: Path) -> list[Flag]:
    """Remove all byte code from an install tree; return a flag for each file that is not where Python writes it.

    Python itself writes byte code into `__pycache__`, beside the source from which it is made, and no links.
    """
    flags = []
    for path in sorted(path for path in install.rglob("*") if path.suffix in _BYTE_CODE or path.name == "__pycache__"):
        is_link = path.is_symlink()
        if is_link or (path.is_file() and path.parent.name != "__pycache__"):
            words = "a link that Python loads as byte code" if is_link else "byte code in place of a module's text"
            where = printable(str(path.relative_to(install)))
            flags.append(Flag("byte code", f"the build installed {words}; it was removed", where=where))
        if is_link or path.is_file():
            path.unlink()
    return flags


def not_generated(install: Path, generated: Mapping[str, Generated]) -> list[str]:
    """Return the paths of Python among the types that ROS's tools do not make, and of libraries there.

    `generated` is what they make of each package of interfaces, by its name.
    """
    modules = {
        f"{package}/{name}": digest for package, made in generated.items() for name, digest in made.modules.items()
    }
    exports = {
        f"{package}/{name}": set(text.splitlines())
        for package, made in generated.items()
        for name, text in made.exports.items()
    }
    site = install / ros_env.SITE_IN_PREFIX
    found = []
    for path in sorted(path for folder in _TYPE_FOLDERS for path in site.glob(f"*/{folder}/**/*")):
        name = path.relative_to(site).as_posix()
        if path.suffix == ".py" and path.is_file():
            data = untrusted.read_bytes(path.resolve()) or b""
            lines = set(data.decode("utf-8", "replace").splitlines())
            known = modules.get(name) == hashlib.sha256(data).hexdigest() or lines <= exports.get(name, set())
        else:
            known = path.suffix != ".so"
        if not known:
            found.append(printable(path.relative_to(install).as_posix()))
    return found[:_MAX_LISTED]
