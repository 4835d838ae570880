"""Interface types for the observer: ROS's own, and the contract's from its own build, never a submission's.

The contract's can be imported only where the path leads to that build, as in grader/trials/worker.py. It has the types
under one package name: that of the package in which the submission has them.
"""

from __future__ import annotations

import importlib
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any


@cache
def interface(type_: str) -> Any:
    """Return the class of a type as a contract names it: "srv/SetSpeed" or "std_msgs/msg/Float32"."""
    *package, kind, name = type_.split("/")
    return getattr(importlib.import_module(f"{package[0] if package else own_package(type_)}.{kind}"), name)


@cache
def own_package(type_: str) -> str:
    """Return the name of the package that has a type of the contract's own, such as "srv/SetSpeed"."""
    kind, name = type_.split("/")
    module = re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", name).lower()
    return next(path.parts[-3] for folder in sys.path for path in Path(folder).glob(f"*/{kind}/_{module}.py"))
