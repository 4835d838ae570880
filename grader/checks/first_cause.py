"""Say first what stopped a package, by its text and by what it printed, and then what else its text shows."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from grader.evidence import Fault
from grader.words import say

_MOST = 8


def sentence(fault: Fault) -> str:
    """Return where a fault is and what it is: "CMakeLists.txt:10: it names `srv/SetSped.srv`, which is not there"."""
    return f"{fault.path}{f':{fault.line}' if fault.line else ''}: {fault.text}"


def shown_by(faults: Sequence[Fault], output: str) -> Fault | None:
    """Return the first fault that the output of a build or of a node shows, by its words or its place; None if none."""
    for fault in faults:
        place = [rf'{re.escape(fault.path)}(?::|", line ){fault.line}'] if fault.line else []
        if any(re.search(rf"(?<!\w)(?:{words})(?!\w)", output) for words in [*map(re.escape, fault.shown_as), *place]):
            return fault
    return None


def behind(faults: Sequence[Fault], missing: Collection[str]) -> Fault | None:
    """Return the first fault because of which one of the `missing` programs and files is not there, None if none is."""
    return next((fault for fault in faults if not set(missing).isdisjoint(fault.lacks)), None)


def listing(faults: Sequence[Fault], lead: str) -> str:
    """Return the faults as lines below `lead`, each with its cure; "" if there are none."""
    if not faults:
        return ""
    lines = [f"  {sentence(fault)} ({fault.cure})" for fault in faults[:_MOST]]
    more = [say("  and {n} more", n=len(faults) - _MOST)] if len(faults) > _MOST else []
    return "\n".join([lead, *lines, *more])


def besides(faults: Sequence[Fault]) -> str:
    """Return the first faults as the end of a sentence, "" if there are none."""
    shown = "; ".join(f"{sentence(fault)} ({fault.cure})" for fault in faults[:3])
    return say("; the package's text shows: {shown}", shown=shown) if shown else ""
