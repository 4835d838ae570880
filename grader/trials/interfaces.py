"""The contract's interface types, for the observer. They come from the contract's own build, never a submission's.

Importable only where the path leads to that build, as in grader/trials/worker.py. It has the types under one package
name: that of the package in which the submission has them.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any


def _package() -> str:
    return next(path.parts[-3] for folder in sys.path for path in Path(folder).glob("*/srv/_set_speed.py"))


TYPES_PACKAGE = _package()
"""The name of the package that has the types."""


def _type(kind: str, name: str) -> Any:
    return getattr(importlib.import_module(f"{TYPES_PACKAGE}.{kind}"), name)


NavigateToPosition = _type("action", "NavigateToPosition")
SensorFusionData = _type("msg", "SensorFusionData")
GetRobotStatus = _type("srv", "GetRobotStatus")
SetSpeed = _type("srv", "SetSpeed")

SERVICES = {"set_speed": SetSpeed, "get_status": GetRobotStatus}
