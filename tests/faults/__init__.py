"""Faults put into the kit by hand, one at a time, to see whether its tests notice them: faults.yaml lists them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import yaml


@dataclass(frozen=True)
class Fault:
    """A symptom, the text that causes it, and the test that noticed it, as the top of faults.yaml says."""

    name: str
    file: str
    old: str
    new: str
    seen_by: str


_LISTED = yaml.safe_load(Path(__file__).with_name("faults.yaml").read_text())
FAULTS = tuple(Fault(name, **given) for name, given in _LISTED.items())
