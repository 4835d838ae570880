"""Say first what stopped a package, by its text and by what it printed, and then what else its text shows."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grader.evidence import Fault

_MOST = 8


def sentence(fault: Fault) -> str:
    """Return where a fault is and what it is: "CMakeLists.txt:10: it names `srv/SetSped.srv`, which is not there"."""
    return f"{fault.path}{f':{fault.line}' if fault.line else ''}: {fault.text}"


def shown_by(faults: Sequence[Fault], output: str, *, by_path: bool = False) -> Fault | None:
    """Return the first fault that the output of a build or of a node is about, None if there is none.

    The output of ROS's tools names what they stumble over, and so do the faults, in backquotes. A node's output names
    few files, so with `by_path` that of the fault is enough; a build's names them all.
    """
    for fault in faults:
        words = [*re.findall(r"`([^`]+)`", fault.text), f"{fault.path}:{fault.line}", *([fault.path] * by_path)]
        if any(re.search(rf"(?<!\w){re.escape(word.rstrip('('))}(?!\w)", output) for word in words):
            return fault
    return None


def listing(faults: Sequence[Fault], lead: str) -> str:
    """Return the faults as lines below `lead`, each with its cure; "" if there are none."""
    if not faults:
        return ""
    lines = [f"  {sentence(fault)} ({fault.cure})" for fault in faults[:_MOST]]
    more = [f"  and {len(faults) - _MOST} more"] if len(faults) > _MOST else []
    return "\n".join([lead, *lines, *more])


def besides(faults: Sequence[Fault]) -> str:
    """Return the first faults as the end of a sentence, "" if there are none."""
    shown = "; ".join(f"{sentence(fault)} ({fault.cure})" for fault in faults[:3])
    return f"; the package's text shows: {shown}" if shown else ""
