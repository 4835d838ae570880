"""A record of a launch for machines: one JSON object per line and event, written as it happens.

The launch file is somebody's Python and runs in the same process, so the record is a help and no evidence against its
author.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

VARIABLE = "ROS2_LAUNCH_RECORD"


class Record:
    """The file, or nothing where nobody asked for one."""

    def __init__(self, path: Path | None) -> None:
        self._file = None if path is None else path.open("a", buffering=1, encoding="utf-8")

    def add(self, event: str, **facts: Any) -> None:
        """Write one event: `started` and `ended` for each process, `launch_ended` last."""
        if self._file is not None:
            self._file.write(json.dumps({"event": event, "time_s": round(time.time(), 3), **facts}) + "\n")

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None
