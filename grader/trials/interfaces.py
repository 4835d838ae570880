"""The contract's interface types, for the observer. They come from the contract's own build, never a submission's.

Importable only where the path leads to that build, as in grader/trials/worker.py. It has the types under one package
name: the package's own, or the one into which a submission has moved its interfaces.
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
