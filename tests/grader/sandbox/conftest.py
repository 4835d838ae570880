"""What the tests of forked programs share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.programs import ENVIRONMENT

from grader.sandbox.warm_start import WarmPython


@pytest.fixture(scope="module")
def warm() -> Iterator[WarmPython]:
    """A process to fork programs from."""
    with WarmPython(ENVIRONMENT) as process:
        yield process


@pytest.fixture
def install(tmp_path: Path) -> Path:
    """An install tree of a package "pkg", which `helpers.programs.write` writes programs into."""
    folder = tmp_path / "install"
    (folder / "lib" / "pkg").mkdir(parents=True)
    tmp_path.chmod(0o755)
    return folder
