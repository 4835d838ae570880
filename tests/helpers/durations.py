"""Name the tests that have become dearer since an earlier run, from the lists that `pytest --durations=60` prints.

python tests/helpers/durations.py EARLIER NOW
"""

from __future__ import annotations

import re
import statistics
import sys
from pathlib import Path

DEARER, LEAST_S = 1.5, 2.0
_LINE = re.compile(r"^ *(\d+\.\d+)s (call|setup|teardown) +(tests/\S.*)$", re.MULTILINE)


def read(text: str) -> dict[str, float]:
    """Return the seconds of each test, with its phase, from a run's output."""
    return {f"{test} ({phase})": float(seconds) for seconds, phase, test in _LINE.findall(text)}


def dearer(earlier: dict[str, float], now: dict[str, float]) -> list[str]:
    """Return a line for each test that takes longer, beyond what all tests together do on a slower machine."""
    both = sorted(earlier.keys() & now.keys())
    machine = statistics.median(now[test] / earlier[test] for test in both) if both else 1.0
    grown = {
        test: f"{test}: {earlier[test]:.0f} s, now {now[test]:.0f} s"
        for test in both
        if now[test] > max(DEARER * machine * earlier[test], machine * earlier[test] + LEAST_S)
    }
    least = min(earlier.values(), default=0.0) * machine
    new = {test: f"{test}: now {now[test]:.0f} s" for test in now.keys() - earlier.keys() if now[test] > DEARER * least}
    return [line for _, line in sorted((grown | new).items(), key=lambda item: -now[item[0]])]


if __name__ == "__main__":
    earlier, now = (read(Path(path).read_text()) if Path(path).exists() else {} for path in sys.argv[1:3])
    lines = dearer(earlier, now) if earlier else [f"{len(now)} durations; no earlier run to compare with"]
    print("\n".join(["Dearer than the run before:", *lines] if earlier else lines))
