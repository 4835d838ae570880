"""What a report says about a requirement, as lines of text for other programs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def losses(requirement: dict[str, Any]) -> Iterator[str]:
    """Return what was seen, expected and what to try, for each check of a requirement that did not pass."""
    for check in requirement.get("checks", ()):
        if check["outcome"] == "passed":
            continue
        yield f"{check['sentence'] or check['id']}: {check['outcome'].replace('_', ' ')}"
        for name in ("seen", "expected", "try", "because"):
            if check.get(name):
                yield f"  {name:<9} {check[name]}"
