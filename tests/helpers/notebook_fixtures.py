"""Fixtures for tests of notebooks: the course, a small example that can break every rule, and a workspace."""

from __future__ import annotations

import contextlib
import functools
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader import KIT
from grader.authoring import book, notebook_source
from grader.notebook import interface_types
from grader.notebook.workspace import FRESH, VARIABLE, Workspace
from grader.scoring.rubric import Rubric, load
from helpers.notebook_rules import Page

EXAMPLE = KIT / "tests" / "notebooks" / "example"


@pytest.fixture(scope="session")
def rubric() -> Rubric:
    """The kit's rubric."""
    return load(KIT / "rubric.yaml")


@functools.cache
def source_page(name: str) -> Page:
    """Read a notebook of the course from its source."""
    return Page(name, notebook_source.read(name, load(KIT / "rubric.yaml")), notebook_source.NOTEBOOKS)


def stored(file: Path) -> Page:
    """Read an edition of a notebook."""
    return Page(file.stem, book.read_stored(file), file.parent)


@functools.cache
def student_page(name: str) -> Page:
    """Read the student edition of a notebook of the course."""
    return stored(book.student_file(name))


@functools.cache
def published_page(name: str) -> Page:
    """Read the published edition of a notebook of the course."""
    return stored(book.published_file(name))


@pytest.fixture(scope="session")
def built_example(tmp_path_factory: pytest.TempPathFactory, rubric: Rubric) -> Path:
    """The folder of the example with both editions, built once: it needs no ROS."""
    folder = tmp_path_factory.mktemp("built") / "notebooks"
    shutil.copytree(EXAMPLE, folder)
    made = book.Notebook("02_example", rubric, folder, solution_of_the_example)
    made.write_student()
    assert made.publish().error is None
    return folder


@pytest.fixture
def example(built_example: Path, tmp_path: Path) -> Path:
    """A copy of the built example that a test may change."""
    return Path(shutil.copytree(built_example, tmp_path / "notebooks"))


def solution_of_the_example(_notebook: str, path: str) -> str:
    """Return the answer to the example's exercise."""
    return {
        "answer.py": '"""Hold the answer."""\n\nANSWER = 42\n',
        "tail.py": '"""Hold a function that is written later."""\n\n\n'
        'def first():\n    """Return the answer."""\n    return 42\n',
    }[path]


@pytest.fixture
def notebook(example: Path, rubric: Rubric) -> book.Notebook:
    """The notebook of the example."""
    return book.Notebook("02_example", rubric, example, solution_of_the_example)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Workspace]:
    """An empty workspace, which `find` finds; the process is restored afterwards."""
    found = Workspace(tmp_path / "ws")
    environment, path, bytecode = dict(os.environ), list(sys.path), sys.dont_write_bytecode
    monkeypatch.chdir(tmp_path)
    os.environ[VARIABLE] = str(found.root)
    os.environ[FRESH] = "1"
    yield found
    os.environ.clear()
    os.environ.update(environment)
    sys.path[:], sys.dont_write_bytecode = path, bytecode


@contextlib.contextmanager
def as_in_a_kernel(workspace: Workspace) -> Iterator[None]:
    """Let this process import the modules of a workspace's package, and forget them afterwards."""
    interface_types.load(workspace)
    # The interfaces stay loaded for the whole process, so the package's path is that of an earlier test.
    name = workspace.package.name
    path = sys.modules[name].__path__
    before = list(path)
    path[:] = [str(workspace.package / name), *before]
    yield
    path[:] = before
    for module in [module for module in sys.modules if module.startswith(f"{name}.")]:
        if module.split(".")[1] not in ("msg", "srv", "action"):
            sys.modules.pop(module)
