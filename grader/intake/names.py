"""File names in a submission: make them printable, compare them, recognise those that tools have made."""

from __future__ import annotations

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


def safe_name(part: str) -> str:
    """Return the file name `part` with unprintable characters written as %XX."""
    return "".join(char if char.isprintable() else f"%{ord(char):02X}" for char in part)


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
