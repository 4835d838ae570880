"""Names that students give to files: made printable, made safe to write, and known not to be theirs."""

from __future__ import annotations

import unicodedata

# Made by tools, never written by a student, and often large.
NEVER_KEPT = frozenset(
    {
        *("__MACOSX", "__pycache__", "node_modules", "site-packages", "dist-packages"),
        *(".git", ".hg", ".svn", ".venv", ".tox", ".nox", ".eggs"),
        *(".mypy_cache", ".pytest_cache", ".ruff_cache", ".hypothesis", ".ipynb_checkpoints", ".vscode", ".idea"),
    }
)
NEVER_KEPT_FILES = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})

LONGEST_NAME = 200  # bytes; file systems take 255, and the grader adds suffixes
LONGEST_PATH = 1000  # bytes; the kernel takes 4096, CMake and colcon add their own folders
DEEPEST = 20  # folders


def safe_name(part: str) -> str:
    """Return the file name `part` with invisible characters written as %XX, so that it can be shown everywhere."""
    return "".join(char if char.isprintable() else f"%{ord(char):02X}" for char in part)


def collision_key(path: str) -> str:
    """Return what two paths share that are one on some file systems (letter case, Unicode form)."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def never_kept(folder: str) -> bool:
    """Say whether a folder of this name is made by tools."""
    return folder in NEVER_KEPT or folder.endswith(".egg-info")


def never_kept_file(name: str) -> bool:
    """Say whether a file of this name is made by tools."""
    return name in NEVER_KEPT_FILES or name.startswith("._") or name.endswith((".pyc", ".pyo"))
