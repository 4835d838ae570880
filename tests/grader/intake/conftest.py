"""Folders for the tests of the intake."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def handed_in(tmp_path: Path) -> Path:
    return tmp_path / "handed_in"


@pytest.fixture
def into(tmp_path: Path) -> Path:
    return tmp_path / "into"
