"""Find the first error in the log of `colcon build`."""

from __future__ import annotations

import itertools
import re


def first_error(log: str) -> str:
    """Return the first error in a build's log with the lines that explain it, "" if no line is marked as an error."""
    lines = log.splitlines()
    marked = (i for i, line in enumerate(lines) if re.search(r"\bError\b|\berror:|\bERROR\b", line))
    first = next(marked, None)
    if first is None:
        return ""
    # CMake explains an error in the indented lines below it, colcon in the next one.
    explained = itertools.takewhile(lambda line: line.startswith("  ") or not line.strip(), lines[first + 1 :])
    below = [*explained] or (lines[first + 1 : first + 2] if lines[first].endswith(":") else [])
    text = " ".join(line.strip() for line in [lines[first], *below] if line.strip())
    # rosidl's own error comes at the end of the command that failed.
    text = text[max(0, text.find("Error processing")) :]
    return re.sub(r"/ws/src/[^/\s']+/+|\bsubmission/(?=package\.xml)", "", text)[:500]
