"""Try a function on a table of cases, on the spot: `tries`."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Mapping


class MissingError(AttributeError):
    """A module or node of the student's is not there; the reason has been printed."""


def tries(table: Mapping[str, object]) -> None:
    """Compute each call of the table, and print whether it gives what is wanted.

    A call is a text, such as "ramp(0.0, 0.5, 0.1)"; it may use every name of the notebook. Numbers are compared to
    within a millionth, NaN equals NaN.
    """
    names = sys._getframe(1).f_globals
    width = max(map(len, table))
    right = 0
    for call, wanted in table.items():
        try:
            got = eval(call, names)  # the author of the notebook wrote it
            fits = same(got, wanted)
            seen = shown(got)
        except MissingError:
            fits, seen = False, "-"
        except Exception as error:  # of the student's function; the other rows are still of interest
            fits, seen = False, f"{type(error).__name__}: {error}"
        right += fits
        print(
            f"{'right  ' if fits else 'NOT YET'}  {call:{width}}  {seen}"
            + ("" if fits else f", wanted {shown(wanted)}")
        )
    print(f"{right} of {len(table)} right")


def same(got: object, wanted: object) -> bool:
    """Return whether two values are equal, numbers to within a millionth."""
    if isinstance(wanted, bool) or isinstance(got, bool):
        return got is wanted
    if isinstance(wanted, int | float) and isinstance(got, int | float):
        return math.isnan(got) if math.isnan(wanted) else math.isclose(got, wanted, abs_tol=1e-6)
    if dataclasses.is_dataclass(wanted) and type(got) is type(wanted):
        names = [field.name for field in dataclasses.fields(wanted)]
        return all(same(getattr(got, name), getattr(wanted, name)) for name in names)
    if isinstance(wanted, list | tuple) and isinstance(got, list | tuple):
        return len(got) == len(wanted) and all(map(same, got, wanted))
    return got == wanted


def shown(value: object) -> str:
    """Return a value as text, numbers with three decimals and no more digits than they need."""
    if isinstance(value, float):
        return f"{value:.3f}".rstrip("0").rstrip(".") if math.isfinite(value) else str(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        inner = ", ".join(f"{field.name}={shown(getattr(value, field.name))}" for field in dataclasses.fields(value))
        return f"{type(value).__name__}({inner})"
    if isinstance(value, list | tuple):
        inner = ", ".join(map(shown, value))
        return f"[{inner}]" if isinstance(value, list) else f"({inner})"
    return repr(value)
