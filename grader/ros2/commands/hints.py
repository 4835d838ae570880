"""What to say beside a refusal, or while waiting: a name that is nearly the one asked for, a type that differs."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable
from difflib import get_close_matches

from .graph import STEP_S, NamesAndTypes, full_name

# By then what is there has been found, so that a name that is not is worth a word.
FOUND_S = 2.0


def near(name: str, names: Iterable[str]) -> str:
    """Return a line that asks for the nearest of the names, or nothing if none is near or the name is among them."""
    names = list(names)
    found = [] if name in names else get_close_matches(name, names, 1, cutoff=0.7)
    if not found and len(begins := [one for one in names if one.startswith(name) and one != name]) == 1:
        found = begins
    return f"\nDid you mean {found[0]}?" if found else ""


def other_type(name: str, wanted: str, types: Iterable[str]) -> str:
    """Return a warning if what is there has other types than the one that is wanted."""
    there = sorted(set(types))
    parts = wanted.split("/")
    if not there or any(one.split("/")[0] == parts[0] and one.split("/")[-1] == parts[-1] for one in there):
        return ""
    return f"WARNING: {full_name(name)} is of type {', '.join(there)}, not {wanted}"


def wait(ready: Callable[[], bool], name: str, wanted: str, there: Callable[[], NamesAndTypes]) -> None:
    """Wait until something is ready; remark once on a type that differs, or on a name that is nearly the same.

    Args:
        ready: says whether the wait is over.
        name: what is waited for.
        wanted: the type that is asked for.
        there: gives the names and types that others have.
    """
    began = looked = time.monotonic()
    said = False
    while not ready():
        now = time.monotonic()
        if not said and now - began >= FOUND_S and now - looked >= 0.5:
            looked, found = now, there()
            types = [kind for one, kinds in found if one == full_name(name) for kind in kinds]
            remark = (
                other_type(name, wanted, types) if types else near(full_name(name), (one for one, _ in found)).strip()
            )
            if remark:
                print(remark, file=sys.stderr, flush=True)
                said = True
        time.sleep(STEP_S)
