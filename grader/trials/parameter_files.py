"""Change values in copies of a package's parameter files, to see whether the files reach the nodes. Runs nothing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

_MAX_BYTES = 100_000


def write_changed(
    share: Path, out: Path, telltales: Mapping[str, float], names: str = "*.yaml"
) -> tuple[dict[Path, str], dict[str, float]]:
    """Write copies of the parameter files in a share folder that match `names` to `out`, with the `telltales` they set.

    Returns:
        the copies with the paths of the original files in `share`, and the values set in them by parameter name.
    """
    copies: dict[Path, str] = {}
    values: dict[str, float] = {}
    for path in sorted(share.rglob(names)):
        document = _load(path)
        set_here: dict[str, float] = {}
        for parameters in _parameter_blocks(document):
            for name, value in telltales.items():
                if name in parameters and (typed := _typed_like(parameters[name], value)) is not None:
                    parameters[name] = set_here[name] = typed
        text = _dump(document)
        if text is not None:
            copy = out / path.relative_to(share)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(text)
            copies[copy] = str(path.relative_to(share))
            values |= set_here
    return copies, values


def _dump(document: Any) -> str | None:
    """Return a document as YAML; None if it is None, or can be read but not written, such as a number of 5000 digits.

    Such a file is left as it is, for its node to cope with.
    """
    try:
        return None if document is None else yaml.safe_dump(document)
    except (ValueError, RecursionError, yaml.YAMLError):
        return None


def _typed_like(old: Any, new: float) -> float | None:
    """Return the new value with the old one's type, which is the node's; None if that type cannot hold it."""
    if isinstance(old, int) and not isinstance(old, bool):
        return int(new) if new.is_integer() else None
    return new if isinstance(old, float) else None


def _load(path: Path) -> Any:
    """Return a YAML document; None for a file that is not valid YAML, about which the node itself will complain."""
    try:
        if path.is_symlink() or path.stat().st_size > _MAX_BYTES:
            return None
        text = path.read_text()
        # Aliases can make a short file enormous, and no node can load them.
        aliased = "*" in text and any(isinstance(token, yaml.AliasToken) for token in yaml.scan(text))
        return None if aliased else yaml.safe_load(text)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, yaml.YAMLError,
            RecursionError):  # fmt: skip
        return None  # PyYAML raises more than YAMLError: `!!bool perhaps` is a KeyError


def _parameter_blocks(document: Any) -> Iterator[dict[str, Any]]:
    if isinstance(document, dict):
        for key, value in document.items():
            if key == "ros__parameters" and isinstance(value, dict):
                yield value
            else:
                yield from _parameter_blocks(value)
