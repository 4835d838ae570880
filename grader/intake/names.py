"""File names in a submission: make them printable, compare them, recognise those that tools have made."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from pathlib import Path

# Made by tools, never written by a student, and often large. Left out of every submission.
_TOOL_FOLDERS = frozenset(
    {
        *("__MACOSX", "__pycache__", "node_modules", "htmlcov", "site-packages", "dist-packages"),
        *(".git", ".hg", ".svn", ".venv", ".tox", ".nox", ".eggs"),
        *(".mypy_cache", ".pytest_cache", ".ruff_cache", ".hypothesis", ".ipynb_checkpoints", ".vscode", ".idea"),
    }
)
# A build tree has one of these names and contains one of the markers: a student's own folder may be called `log`, too.
BUILD_NAMES = frozenset({"build", "install", "log", "devel"})
BUILD_MARKERS = frozenset(
    {"COLCON_IGNORE", ".built_by", ".colcon_install_layout", ".catkin", "CMakeCache.txt", "local_setup.sh"}
)
_TOOL_FILES = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})

MAX_NAME_BYTES = 200  # file systems allow 255, and the grader adds suffixes
MAX_PATH_BYTES = 1000  # the kernel allows 4096; CMake and colcon add their own folders
MAX_DEPTH = 20  # folders
_END_BYTES = 60  # of a shortened name: a suffix, or a platform's number and word behind a person's name


def safe_name(part: str) -> str:
    """Return the file name `part` with unprintable characters written as %XX."""
    return "".join(char if char.isprintable() else f"%{ord(char):02X}" for char in part)


def shortened(name: str) -> str:
    """Return a file name as it is, or, if it is too long, its beginning, a hash of it all, and its end.

    A platform writes whose a file is at the beginning, and at the end is what tells what it is.
    """
    if len(name.encode()) <= MAX_NAME_BYTES:
        return name
    tag = f"~{hashlib.sha256(name.encode()).hexdigest()[:8]}~"
    begin = name.encode()[: MAX_NAME_BYTES - _END_BYTES - len(tag)].decode(errors="ignore")
    return begin + tag + name.encode()[-_END_BYTES:].decode(errors="ignore")


def natural(name: str) -> tuple[tuple[str, int], ...]:
    """Return a key that sorts names as people do: v9 before v10."""
    parts = re.split(r"([0-9]+)", name)
    numbers = (*(int(digits) for digits in parts[1::2]), -1)
    return tuple(zip(parts[::2], numbers, strict=True))


def collision_key(path: str) -> str:
    """Return a key that is equal for paths that some file systems treat as one (letter case, Unicode form)."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def tool_folder(folder: str) -> bool:
    """Return whether a folder of this name is made by a tool."""
    return folder in _TOOL_FOLDERS or folder.endswith(".egg-info")


def build_tree(folder: Path) -> bool:
    """Return whether a folder on the disk was made by a build."""
    return folder.name in BUILD_NAMES and any((folder / marker).exists() for marker in BUILD_MARKERS)


def tool_file(name: str) -> bool:
    """Return whether a file of this name is made by a tool."""
    return name in _TOOL_FILES or name.startswith("._") or name.endswith((".pyc", ".pyo"))
