"""Change values in copies of a package's parameter files, to see whether the files reach the nodes. Runs nothing."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import yaml

from grader.yaml_reader import ParameterBlock, parameter_blocks, scalar_of

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
        text, blocks = _load(path)
        places: dict[int, tuple[int, str]] = {}
        for node, name in [(node, name) for block in blocks for name, node in block.values.items()]:
            if isinstance(node, yaml.ScalarNode) and name in telltales:
                typed = _typed_like(scalar_of(node), telltales[name])
                if typed is not None:
                    places[node.start_mark.index] = node.end_mark.index, str(typed)
                    values[name] = typed
        if blocks:
            copy = out / path.relative_to(share)
            copy.parent.mkdir(parents=True, exist_ok=True)
            for start, (end, value) in sorted(places.items(), reverse=True):
                text = text[:start] + value + text[end:]
            copy.write_text(text, encoding="utf-8")
            copies[copy] = str(path.relative_to(share))
    return copies, values


def _typed_like(old: object, new: float) -> float | None:
    """Return the new value with the old one's type, which is the node's; None if that type cannot hold it."""
    if isinstance(old, int) and not isinstance(old, bool):
        return int(new) if new.is_integer() else None
    return new if isinstance(old, float) else None


def _load(path: Path) -> tuple[str, list[ParameterBlock]]:
    """Return the text and the blocks of a parameter file; no blocks of one that rcl, and so the node, refuses."""
    try:
        if path.is_symlink() or path.stat().st_size > _MAX_BYTES:
            return "", []
        text = path.read_text(encoding="utf-8-sig")
        return text, parameter_blocks(text)
    except (OSError, ValueError, RecursionError):
        return "", []
