"""Find the code in an install tree that cannot be read: what is read for a package has to be what runs.

Text counts wherever it came from: handed in, written or configured by CMake, made by setuptools or rosidl; the source
`quality` reads all of it. Byte code is removed, and Python compiles the text that everybody can read.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from grader.building.install_tree import regular_files
from grader.building.type_hashes import Generated
from grader.evidence import Flag
from grader.host import ros_env
from grader.python_ast import parse
from grader.sandbox import untrusted
from grader.sanitize import printable

_BYTE_CODE = (".pyc", ".pyo")
_UNCHECKED_HASH = 0b01  # the flags in a header of byte code that Python loads whatever its source says (PEP 552)
_TYPE_FOLDERS = ("msg", "srv", "action")
_SHEBANG = re.compile(rb"#![^\n]*\n?")
# No other interpreter, no code on the line, and none that the build has installed.
PYTHON = re.compile(
    rb"#! ?(/usr/bin/env (-S )?|(?!/ws/(install|build|src))[\w./+-]*/)python[\d.]*( -[uBEsSIO]+)*[ \t\r]*\n"
)
_SHELL = re.compile(rb"#![^\n]*\b(ba|da)?sh\b")
_EXTENSION = re.compile(r"\w+_s__rosidl_typesupport_\w+\.so")
_ENTRY_SCRIPT = re.compile(r"# EASY-INSTALL-ENTRY-SCRIPT: ('[\w.=+!-]+'),'console_scripts',('[\w.-]+')\n")
# The SHA-256 of what setuptools 79 writes for an entry point, without the first line and the two names.
_ENTRY_SCRIPT_DIGEST = "18eb4eac508fcd1d7564cb8d5f05df5c3ccf64c0bfd1ae70a3a989821894c308"
# In a shell script: its own folder, lines that only note such a folder, and the line that starts Python.
_HERE = re.compile(
    r'\$\(dirname +"?(?:\$0|\$\(readlink -f +"?\$0"?\)|\$\(realpath +"?\$0"?\))"?\)|\$\(cd +"?HERE[\w./]*"? *&& *pwd\)'
)
_NOTES = re.compile(r'(set -[a-z]+( pipefail)?|[A-Za-z]\w*="?HERE[\w./]*"?|export (PYTHONUNBUFFERED|RCUTILS_\w+)=\w+)')
_STARTS_PYTHON = re.compile(
    r"(exec +)?(/usr/bin/(env +)?)?python3?( +-[uBEs])*( +-m +(?P<module>[\w.]+)"
    r"| +-c +(?P<quote>[\"'])(import sys; *)?from +(?P<imported>[\w.]+) +import +(?P<function>\w+); *"
    r"((raise +SystemExit|sys\.exit)\((?P=function)\(\)\)|(?P=function)\(\))(?P=quote)"
    r"| +(?:[^\s;&|`()]*[^\w.\s;&|`()-])?"
    r"(?P<file>[\w.-]+)\"?)"
    r"( +\"?\$[@*]\"?)?"
)
_ELF = b"\x7fELF"
_END_OF_ARCHIVE, _ARCHIVE_BYTES = b"PK\x05\x06", 1_000_000  # Python looks for its directory at the end of a file
_MAX_LISTED = 50


def remove_byte_code(install: Path) -> list[Flag]:
    """Remove all byte code from an install tree; return a flag for each file that may hide other code.

    Python itself writes byte code into `__pycache__`, beside the source from which it is made, and no links.
    """
    flags = []
    for path in sorted(path for path in install.rglob("*") if path.suffix in _BYTE_CODE or path.name == "__pycache__"):
        where = printable(str(path.relative_to(install)))
        if path.is_symlink():
            flags.append(Flag("byte code", "the build installed a link that Python loads as byte code", where=where))
        elif not path.is_file():
            continue
        elif path.parent.name != "__pycache__":
            flags.append(Flag("byte code", "the build installed byte code in place of a module's text", where=where))
        elif int.from_bytes((untrusted.read_bytes(path) or b"")[4:8], "little") == _UNCHECKED_HASH:
            words = "the build installed byte code that Python does not compare with its source"
            flags.append(Flag("byte code", words, where=where))
        path.unlink()
    return flags


def unreadable(install: Path, sources: Path, generated: Mapping[str, Generated], nodes: Collection[str]) -> list[str]:
    """Return the paths of code in an install tree that cannot be read as a package's own Python.

    That is what a node can run and is not text (binaries, archives, what is behind links); a node's program in another
    language; and anything but rosidl's among the types, which nobody lints, measures or mutates.

    Args:
        install: the install tree, without byte code.
        sources: the folder of all that was handed in.
        generated: by the name of each package of interfaces, what ROS's tools make of it.
        nodes: the names of the contract's executables.
    """
    expected = {
        f"{package}/{name}": digest for package, made in generated.items() for name, digest in made.modules.items()
    }
    exports = {
        f"{package}/{name}": set(text.splitlines())
        for package, made in generated.items()
        for name, text in made.exports.items()
    }
    site = install / ros_env.SITE_IN_PREFIX
    prebuilt = {_digest(data) for path in regular_files(sources) if (data := _read(path)).startswith(_ELF)}
    found = _links(site)
    for path in sorted(install.rglob("*")):
        if not path.is_file():
            continue
        data = _read(path)
        if is_among_types(path, install):
            if path.suffix == ".py":
                name = path.relative_to(site).as_posix()
                lines = set(data.decode("utf-8", "replace").splitlines())
                known = expected.get(name) == _digest(data) or lines <= exports.get(name, set())
            else:
                known = path.suffix != ".so"
        elif _is_python(path, data, install, nodes):
            known = bool(data or not path.stat().st_size) and b"\0" not in data
        elif path.suffix == ".so" and path.is_relative_to(site):
            known = _EXTENSION.fullmatch(path.name) is not None
        elif _is_program(path, install) and path.name in nodes:
            known = bool(_SHELL.match(data)) and _starts_read_code(data.decode("utf-8", "replace"), path, site)
        else:
            known = _digest(data) not in prebuilt and not _is_archive(path)
        if not known:
            found.append(path)
    return sorted(printable(path.relative_to(install).as_posix()) for path in found)[:_MAX_LISTED]


def _links(site: Path) -> list[Path]:
    """Return the links that lead to Python: by its path alone, a module behind one seems not to be there."""
    links = [path for path in site.rglob("*") if path.is_symlink()]
    return [path for path in links if path.suffix == ".py" or any(path.resolve().rglob("*.py"))]


def python_texts(install: Path, nodes: Collection[str]) -> Iterator[tuple[str, bytes]]:
    """Yield path and content of the Python in an install tree that a package answers for: modules and programs.

    Left out is what rosidl, colcon and setuptools write: types, set-up for shells, programs of entry points.
    """
    for path in sorted(install.rglob("*")):
        if path.is_file() and not is_among_types(path, install) and not _is_of_colcon(path, install):
            data = _read(path)
            if _is_python(path, data, install, nodes) and not _starts_an_entry_point(data):
                yield path.relative_to(install).as_posix(), data


def _is_program(path: Path, install: Path) -> bool:
    """Return whether a file is where `ros2 run` looks, or in bin."""
    return path.parent == install / "bin" or path.parent.parent == install / "lib"


def _is_python(path: Path, data: bytes, install: Path, nodes: Collection[str]) -> bool:
    """Return whether a file is a module or a Python program, be it one that lacks the line with its interpreter."""
    if path.suffix == ".py":
        return True
    bare = path.name in nodes and not data.startswith(b"#!") and b"\0" not in data
    return _is_program(path, install) and bool(PYTHON.match(data) or (bare and parse(data) is not None))


def _is_of_colcon(path: Path, install: Path) -> bool:
    return path.parent == install and path.name.startswith("_local_setup_util_")


def is_among_types(path: Path, install: Path) -> bool:
    """Return whether a file is where rosidl puts a package's types."""
    site = install / ros_env.SITE_IN_PREFIX
    parts = path.relative_to(site).parts if path.is_relative_to(site) else ()
    return len(parts) > 2 and parts[1] in _TYPE_FOLDERS


def without_first_line(data: bytes) -> bytes:
    """Return a program without the line that names its interpreter, which setuptools changes."""
    return _SHEBANG.sub(b"", data, count=1)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _read(path: Path) -> bytes:
    return untrusted.read_bytes(path.resolve()) or b""


def _is_archive(path: Path) -> bool:
    """Return whether a file is an archive of Python, from which Python imports whatever it is called."""
    try:
        with untrusted.open_file(path.resolve()) as stream:
            stream.seek(max(0, path.stat().st_size - _ARCHIVE_BYTES))
            end = stream.read(_ARCHIVE_BYTES)
    except OSError:
        return False
    return _END_OF_ARCHIVE in end and b".py" in end


def _starts_read_code(script: str, path: Path, site: Path) -> bool:
    """Return whether a shell script only starts Python, with a module or a program of the install tree."""
    script = script.replace("${BASH_SOURCE[0]}", "$0")
    for _ in range(2):  # one may be inside another
        script = _HERE.sub("HERE", script)
    lines = [line.strip() for line in script.splitlines()[1:]]
    commands = [line for line in lines if line and not line.startswith("#") and not _NOTES.fullmatch(line)]
    started = _STARTS_PYTHON.fullmatch(commands[0]) if len(commands) == 1 else None
    if started is None:
        return False
    if module := started["module"] or started["imported"]:
        place = site.joinpath(*module.split("."))
        inside = "__main__.py" if started["module"] else "__init__.py"
        return place.with_suffix(".py").is_file() or (place / inside).is_file()
    return started["file"].endswith(".py") or bool(PYTHON.match(_read(path.with_name(started["file"]))))


def _starts_an_entry_point(data: bytes) -> bool:
    """Return whether a program is the one that setuptools writes for an entry point, letter by letter."""
    text = _SHEBANG.sub(b"", data, count=1).decode("utf-8", "replace")
    match = _ENTRY_SCRIPT.match(text)
    if match is None:
        return False
    without_names = text.replace(match.group(1), "''").replace(match.group(2), "''")
    return hashlib.sha256(without_names.encode()).hexdigest() == _ENTRY_SCRIPT_DIGEST
