"""File names in a submission: make them printable, compare them, recognise those that tools have made."""

from __future__ import annotations

import unicodedata

# Made by tools, never written by a student, and often large. Left out of every submission.
_TOOL_FOLDERS = frozenset(
    {
        *("__MACOSX", "__pycache__", "node_modules", "htmlcov", "site-packages", "dist-packages"),
        *(".git", ".hg", ".svn", ".venv", ".tox", ".nox", ".eggs"),
        *(".mypy_cache", ".pytest_cache", ".ruff_cache", ".hypothesis", ".ipynb_checkpoints", ".vscode", ".idea"),
    }
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


def tool_file(name: str) -> bool:
    """Return whether a file of this name is made by a tool."""
    return name in _TOOL_FILES or name.startswith("._") or name.endswith((".pyc", ".pyo"))
