"""Type hashes are computed from the text of the definitions."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers import course as spec

from grader.building import type_hashes


@pytest.mark.slow  # a run of rosidl; each build of the contract compares them
@pytest.mark.sandbox
def test_hashes_are_computed_from_the_text(tmp_path: Path):
    texts = type_hashes.definitions(spec.CONTRACT)
    found = type_hashes.compute(texts, spec.PACKAGE, tmp_path)
    assert sorted(found.hashes) == sorted(spec.INTERFACES)
    # A comment is not part of a type, the type of a field is.
    commented = {name: f"# {name}\n{text}" for name, text in texts.items()}
    assert type_hashes.compute(commented, spec.PACKAGE, tmp_path).hashes == found.hashes
    changed = {**texts, "srv/SetSpeed.srv": texts["srv/SetSpeed.srv"].replace("float32", "float64")}
    other = type_hashes.compute(changed, spec.PACKAGE, tmp_path)
    assert [name for name, digest in found.hashes.items() if digest != other.hashes[name]] == ["srv/SetSpeed"]


@pytest.mark.slow  # a run of rosidl more
@pytest.mark.sandbox
def test_a_definition_that_cannot_be_read_takes_no_other_along(tmp_path: Path):
    texts = type_hashes.definitions(spec.CONTRACT)
    good = type_hashes.compute(texts, spec.PACKAGE, tmp_path)
    with_bad = type_hashes.compute({**texts, "msg/Bad.msg": "floot x\n = y"}, spec.PACKAGE, tmp_path)
    assert with_bad.hashes == good.hashes
    assert with_bad.modules == good.modules
