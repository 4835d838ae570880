"""Fixtures for tests that grade: real builds, real walls, real nodes."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.course import COURSE
from submissions.edits import EDITS, REFERENCE, apply

from grader import KIT, building, pipeline
from grader.report import data
from grader.scoring import rubric
from grader.settings import Reuse

Graded = dict[str, Any]


@pytest.fixture(scope="session")
def reference() -> Path:
    """The reference package."""
    return REFERENCE


@pytest.fixture(scope="session")
def settings() -> pipeline.Settings:
    """How the kit grades by default."""
    return pipeline.Settings(rubric=rubric.load(KIT / "rubric.yaml"), cache=building.cache_folder())


@pytest.fixture(scope="session")
def contract(settings: pipeline.Settings) -> building.Built:
    """The contract's interfaces, built."""
    return building.build_contract(settings.cache, COURSE)


@pytest.fixture(scope="session")
def graded(
    tmp_path_factory: pytest.TempPathFactory, settings: pipeline.Settings
) -> Callable[[str, Sequence[str]], Graded]:
    """Grade the reference with a named edit ("" for none) on some requirements; return report.json, once each.

    As with `grader grade`, what was seen of the same package by the same code is not collected again.
    """
    done: dict[tuple[str, tuple[str, ...]], Graded] = {}

    def grade(edit: str, requirements: Sequence[str]) -> Graded:
        key = (edit, tuple(requirements))
        if key not in done:
            folder = tmp_path_factory.mktemp(edit or "reference")
            package = apply(EDITS[edit] if edit else None, folder)
            chosen = replace(settings, requirements=tuple(requirements), reuse=Reuse.KEPT)
            grading = pipeline.grade(package, folder / "out", chosen)
            done[key] = json.loads(data.as_json(grading))
        return done[key]

    return grade
