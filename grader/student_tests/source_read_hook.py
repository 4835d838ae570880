"""Notice tests that read the package's source. Loaded in the sandbox by the worker, in each fork.

A test should check what the package does. One that reads how it is written can tell a mutant from the original by that.

Equivalent mutants do not make this hook superfluous, although it needs private parts of CPython and pytest. Without
it, a test that compares the kinds of statements in the source notices 4 of 30 mutants of the toy package, passes all
equivalent mutants and is not convicted (seed 0; seed 1 convicts it, seed 2 sets it aside). And a conviction costs the
package all points for noticed mutants, whereas the hook only sets aside the tests that read the source.
"""

from __future__ import annotations

import doctest
import importlib._bootstrap_external as importing
import inspect
import linecache
import os
import runpy
import sys
import threading
import tokenize
import traceback
import warnings
import zipimport
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import FrameType

import pytest
from _pytest.assertion import rewrite

# How Python itself opens a module: innermost function first, each called by the next.
_LOADER = importing.SourceFileLoader
_LOADS = (_LOADER.get_data.__code__, _LOADER.get_code.__code__)
_LOADS_FOR = (importing._LoaderBasics.exec_module.__code__, runpy._get_module_details.__code__)  # type: ignore[attr-defined]
_RUNS = (runpy._get_code_from_file.__code__, runpy.run_path.__code__)  # type: ignore[attr-defined]
_REWRITES = rewrite._rewrite_test.__code__  # pytest, where a module of the package is named like a test
_LOOKS_FOR_ZIP = zipimport._read_directory.__code__  # type: ignore[attr-defined] # the first step of `run_path`
_FETCHERS = {module.__file__ for module in (linecache, tokenize, inspect)}
# Doctest looks for the lines of docstrings; what it runs is the examples in them.
_REPORTERS = {module.__file__ for module in (traceback, warnings, threading, doctest)}
_FRAME_INFO = inspect.getframeinfo.__code__
_PYTEST = str(Path(pytest.__file__).parents[1] / "_pytest")


def watch(folders: Sequence[str], students: Sequence[str], note: Callable[[str, int], None]) -> None:
    """Call `note` from now on whenever a Python file below `folders` is opened, except for imports and tracebacks.

    Files are known by device and inode, so a link under another name does not hide them.

    Args:
        folders: the folders of the package's modules.
        students: the folders of the submission's code; with that on the stack it is not pytest that reports a failure.
        note: is called with the path and line of the submission's code that led to it, the outermost there is; it
            must not open a file.
    """
    identity, frame_of, base = os.stat, sys._getframe, os.path.basename
    paths = [path for folder in folders for path in Path(folder).rglob("*.py")]
    known = {(facts.st_dev, facts.st_ino) for facts in map(identity, paths)}
    names = {path.name for path in paths} - {"__init__.py"}

    def is_source(path: object) -> bool:
        if not isinstance(path, str | bytes | os.PathLike):
            return False  # a descriptor: the file was noticed when it was opened
        try:
            facts = identity(path)
        except (OSError, ValueError):
            name = os.fsdecode(path)
            return not name.startswith("/") and base(name) in names  # relative to a folder known to `os.open` only
        return (facts.st_dev, facts.st_ino) in known

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event != "open":
            return
        try:
            if is_source(arguments[0]) and not _is_honest(frame_of(1), tuple(students)):
                note(*_place(frame_of(1), tuple(students)))
        except Exception:  # must never make a test fail
            return

    sys.addaudithook(hook)


def _is_honest(frame: FrameType, students: tuple[str, ...]) -> bool:
    """Return whether a file is being opened to import or run a module, or for a traceback's or a warning's lines."""
    frames = list(_outward(frame))
    codes = tuple(frame.f_code for frame in frames[:3])
    if codes[:2] == _LOADS:
        return codes[2] in _LOADS_FOR and type(frame.f_locals.get("self")) is _LOADER
    if codes[0] is _LOOKS_FOR_ZIP or codes[:2] == _RUNS or any(frame.f_code is _REWRITES for frame in frames[:4]):
        return True
    if frame.f_code.co_filename == threading.__file__:
        return True  # Python itself reports an uncaught exception
    rest = list(frames)
    while rest and rest[0].f_code.co_filename in _FETCHERS:
        if rest.pop(0).f_code is _FRAME_INFO:
            return True
    if len(rest) == len(frames) or not rest:
        return False
    caller = rest[0].f_code.co_filename
    if caller.startswith(_PYTEST):
        return not any(frame.f_code.co_filename.startswith(students) for frame in rest)
    # Lines fetched through `traceback` belong to a report of a failure only while an exception is being handled.
    return caller in _REPORTERS and (caller != traceback.__file__ or sys.exc_info()[0] is not None)


def _place(frame: FrameType, students: tuple[str, ...]) -> tuple[str, int]:
    """Return the path and line of the outermost code of the submission, ("", 0) if there is none on the stack."""
    outermost = ("", 0)
    for each in _outward(frame):
        if each.f_code.co_filename.startswith(students):
            outermost = (each.f_code.co_filename, each.f_lineno or 0)
    return outermost


def _outward(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back
