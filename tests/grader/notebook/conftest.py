"""A workspace of one's own for each test; the process is left as it was found."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.notebook.workspace import VARIABLE, Workspace


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Workspace]:
    """An empty workspace, which `find` finds."""
    found = Workspace(tmp_path / "ws")
    environment, path, bytecode = dict(os.environ), list(sys.path), sys.dont_write_bytecode
    monkeypatch.chdir(tmp_path)
    os.environ[VARIABLE] = str(found.root)
    yield found
    os.environ.clear()
    os.environ.update(environment)
    sys.path[:], sys.dont_write_bytecode = path, bytecode
