"""Try a function on a table of cases, on the spot: `tries`."""

from __future__ import annotations

import ast
import dataclasses
import math
import re
import sys
from collections.abc import Mapping
from pathlib import Path

from grader import building
from grader.notebook import interface_types, workspace
from grader.notebook.feedback import Progress


class MissingError(AttributeError):
    """A module or node of the student's is not there; the reason has been printed."""


def tries(table: Mapping[str, object], of: str = "") -> None:
    """Compute each call of the table, and print whether it gives what is wanted.

    A call is a text, such as "ramp(0.0, 0.5, 0.1)"; it may use every name of the notebook. Numbers are compared to
    within a millionth, NaN equals NaN. `of` is a file of the package: its functions are read into the notebook first.
    """
    names = sys._getframe(1).f_globals
    if of and (why := _read_in(Path(of), names)):
        print(f"NOT YET  {of} cannot be run: {why}")
        return
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


_INTERFACES = re.compile(rf"^from {workspace.course().package}\.(msg|srv|action) import", re.MULTILINE)


def _read_in(file: Path, names: dict[str, object]) -> str:
    """Run a file of the package in the notebook, and return why that failed, "" if it did not.

    An import that fails is printed, and the functions that do without it can be tried all the same.
    """
    try:
        text = file.read_text(encoding="utf-8")
        if _INTERFACES.search(text):
            with Progress() as progress:
                if not building.contract_is_built(building.cache_folder(), workspace.course()):
                    progress.say("building the contract's interfaces: once on this machine, about a minute")
                interface_types.load(workspace.find())
        for statement in ast.parse(text).body:
            module = compile(ast.Module([statement], []), str(file), "exec", dont_inherit=True)
            try:
                exec(module, names)
            except ImportError as error:
                print(f"{file.name}, line {statement.lineno}: {error}")
    except FileNotFoundError:
        return "it is not there; run the cell above that writes it"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return ""


def same(got: object, wanted: object) -> bool:
    """Return whether two values are equal, numbers to within a millionth."""
    if isinstance(wanted, bool) or isinstance(got, bool):
        return got is wanted
    if isinstance(wanted, int | float) and isinstance(got, int | float):
        return math.isnan(got) if math.isnan(wanted) else math.isclose(got, wanted, abs_tol=1e-6)
    # By name: a file that was read again has made its classes anew.
    if dataclasses.is_dataclass(wanted) and type(got).__qualname__ == type(wanted).__qualname__:
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
