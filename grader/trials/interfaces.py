"""The contract's interface types, for the observer. They come from the contract's own build, never a submission's.

Importable only in the process of grader/trials/worker.py, whose path is set to that build. It holds the types under one
name: the package's, or that of the package for which a submission has split its interfaces off.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

from grader.contract.spec import INTERFACES_PACKAGE, PACKAGE

_NAME = next(name for name in (PACKAGE, INTERFACES_PACKAGE) if importlib.util.find_spec(name))


def _type(kind: str, name: str) -> Any:
    return getattr(importlib.import_module(f"{_NAME}.{kind}"), name)


NavigateToPosition = _type("action", "NavigateToPosition")
SensorFusionData = _type("msg", "SensorFusionData")
GetRobotStatus = _type("srv", "GetRobotStatus")
SetSpeed = _type("srv", "SetSpeed")

SERVICES = {"set_speed": SetSpeed, "get_status": GetRobotStatus}

__all__ = ["SERVICES", "GetRobotStatus", "NavigateToPosition", "SensorFusionData", "SetSpeed"]
