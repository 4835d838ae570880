"""Try a function on a table of cases, on the spot: `tries`; `answered` is for cases that a notebook does not show."""

from __future__ import annotations

import ast
import dataclasses
import math
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType

from grader.notebook import interface_types, last_hint, workspace
from grader.notebook.feedback import Answer, Checked, Note, seen_expected_try
from grader.words import say

LIMIT_S = 10.0  # wall time of one call in a table


Findings = Iterator[tuple[str, str, str]]
"""For each mistake: what was seen, what was expected, and where to look."""


class HangError(BaseException):
    """A call has not come back; no `except Exception` in it may catch that."""


class MissingError(AttributeError):
    """A module or node of the student's is not there; the reason has been printed."""


def tries(table: Mapping[str, object], of: str = "") -> None:
    """Compute each call of the table, and print whether it gives what is wanted.

    A call is a text, such as "ramp(0.0, 0.5, 0.1)"; it may use every name of the notebook. Numbers are compared to
    within a millionth, NaN equals NaN. `of` is a file of the package: its functions are read into the notebook first.
    """
    names = sys._getframe(1).f_globals
    if of and (why := _read_in(Path(of), names)):
        print(say("NOT YET  {of} cannot be run: {why}", of=of, why=why))
        last_hint.tried(right=False)
        return
    width, verdicts = max(map(len, table)), (say("right"), say("NOT YET"))
    right, hung = 0, False
    for call, wanted in table.items():
        try:
            if hung:
                raise MissingError
            with limited():
                got = eval(call, names)  # the author of the notebook wrote it
            fits = same(got, wanted)
            seen = shown(got)
        except MissingError:
            fits, seen = False, "-"
        except HangError as error:
            hung, fits, seen = True, False, str(error)
        except Exception as error:  # of the student's function; the other rows are still of interest
            fits, seen = False, _said(error, names)
        right += fits
        verdict = f"{verdicts[not fits]:{max(map(len, verdicts))}}"
        print(f"{verdict}  {call:{width}}  {seen}" + ("" if fits else say(", wanted {shown}", shown=shown(wanted))))
    print(say("{right} of {n} right", right=right, n=len(table)))
    last_hint.tried(right == len(table))


def answered(task: str, findings: Findings, look: str) -> Checked:
    """Return the answer for a task of a notebook's own ("TF1"), by its first mistake.

    The learner's functions run as the findings are made; `look` is the advice if one of them raises.
    """
    try:
        with limited():
            finding = next(findings, None)
    except Exception as error:  # of the learner's function
        finding = f"{type(error).__name__}: {error}", say("an answer"), look
    except HangError as error:
        finding = str(error), say("an answer"), say("which loop has no end?")
    notes = (Note("", seen_expected_try(*finding)),) if finding else ()
    return Checked((Answer(task, "", "0", "", not finding, notes=notes),))


def _said(error: Exception, names: Mapping[str, object]) -> str:
    """Return an exception in a line, with what is behind it where Python's words do not say so."""
    said = f"{type(error).__name__}: {error}"
    if "task.Future object" in said or "'coroutine' object" in said:
        return say("{said}: a future is not yet its result; `await` it", said=said)
    inside = any(_is_own(frame.filename) for frame in traceback.extract_tb(error.__traceback__))
    if isinstance(error, NameError) and not inside and error.name not in names:
        return say("{said}: run the cells above this one first", said=said)
    return said


@contextmanager
def limited(seconds: float | None = None) -> Iterator[None]:
    """Raise a HangError, with its line, in what has not ended after `seconds`. Outside the main thread, wait."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_signal: int, frame: FrameType | None) -> None:
        raise HangError(say("hangs at {place}; `await` the future, or end the loop", place=_place(frame)))

    before, timer = signal.signal(signal.SIGALRM, stop), threading.Timer(seconds or LIMIT_S, _interrupt)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        signal.signal(signal.SIGALRM, before)


def _interrupt() -> None:
    """Signal the main thread, and wake the executor in which it may be waiting: the handler runs in Python code."""
    signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGALRM)
    if "rclpy" in sys.modules:
        import rclpy
        from rclpy.utilities import ok

        if ok():  # without a context no executor can be made
            rclpy.get_global_executor().wake()


def _place(frame: FrameType | None) -> str:
    """Return the innermost line in the package, or else in the notebook's own cells: "driver.py:88"."""
    frames = [entry for entry in traceback.extract_stack(frame) if "/site-packages/" not in entry.filename]
    own = [entry for entry in frames if _is_own(entry.filename)] or frames
    return f"{Path(own[-1].filename).name}:{own[-1].lineno}, in `{own[-1].name}`"


def _is_own(filename: str) -> bool:
    """Return whether code is from a file of the package; `tries(of=...)` names that by its relative path."""
    return f"/{workspace.course().package}/" in f"/{filename}"


def _read_in(file: Path, names: dict[str, object]) -> str:
    """Run a file of the package in the notebook, and return why that failed, "" if it did not.

    Its functions know the file's own names alone, as they will in the package: those that the notebook has imported
    would hide an import that the file lacks. An import that fails is printed, and the functions that do without it can
    be tried all the same.
    """
    own: dict[str, object] = {"__name__": names["__name__"]}
    try:
        for statement in ast.parse(file.read_text(encoding="utf-8")).body:
            module = compile(ast.Module([statement], []), str(file), "exec", dont_inherit=True)
            try:
                interface_types.provided(partial(exec, module, own))
            except ImportError as error:
                print(say("{file.name}, line {statement.lineno}: {error}", file=file, statement=statement, error=error))
    except FileNotFoundError:
        return say("it is not there; run the cell above that writes it")
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    finally:
        names |= {name: value for name, value in own.items() if not name.startswith("__")}
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
