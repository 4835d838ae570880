"""Change values in a package's parameter files, so that one can see whether they reach the nodes. Reads text only."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

# Values that differ from every default and make sense: whichever of them a file sets is changed in it.
TELLTALES = {
    "max_linear_speed": 0.375,
    "obstacle_detection_threshold": 0.625,
    "safety_margin": 0.375,
    "fusion_frequency": 10.0,
    "battery_low_threshold": 30.0,
}
_CAP = 100_000


def changed(config: Path, out: Path, names: str = "*.yaml") -> tuple[dict[Path, str], dict[str, float]]:
    """Write changed copies of the parameter files in `config` to `out`, of those whose name matches `names`.

    Returns:
        the copies with their file names, and the values that were set in them by parameter name.
    """
    copies: dict[Path, str] = {}
    values: dict[str, float] = {}
    out.mkdir(parents=True, exist_ok=True)
    for path in sorted(config.glob(names)):
        document = _read(path)
        set_to: dict[str, float] = {}
        for parameters in _parameter_blocks(document):
            for name, value in TELLTALES.items():
                if name in parameters and (kept := _as(parameters[name], value)) is not None:
                    parameters[name] = set_to[name] = kept
        text = _written(document)
        if text is not None:
            copy = out / path.name
            copy.write_text(text)
            copies[copy] = path.name
            values |= set_to
    return copies, values


def _written(document: Any) -> str | None:
    """Return a document as YAML; None for none, and for one that can be read and not written: a number of 5000 digits.

    Such a file stays as it is, and its node has to cope with it.
    """
    try:
        return None if document is None else yaml.safe_dump(document)
    except (ValueError, RecursionError, yaml.YAMLError):
        return None


def _as(old: Any, new: float) -> float | None:
    """Return the new value with the type of the old one, which is the node's; None if it has no such value."""
    if isinstance(old, int) and not isinstance(old, bool):
        return int(new) if new.is_integer() else None
    return new if isinstance(old, float) else None


def _read(path: Path) -> Any:
    """Return a YAML document; None for one that is none, which its reader in the node will complain about."""
    try:
        if path.is_symlink() or path.stat().st_size > _CAP:
            return None
        text = path.read_text()
        # Anchors can make a short file enormous, and no parameter file needs them.
        anchored = "&" in text and any(isinstance(token, yaml.AnchorToken) for token in yaml.scan(text))
        return None if anchored else yaml.safe_load(text)
    except (
        OSError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        ArithmeticError,
        yaml.YAMLError,
        RecursionError,
    ):
        return None  # `!!bool perhaps` is a KeyError, for one


def _parameter_blocks(document: Any) -> Iterator[dict[str, Any]]:
    if isinstance(document, dict):
        for key, value in document.items():
            if key == "ros__parameters" and isinstance(value, dict):
                yield value
            else:
                yield from _parameter_blocks(value)
