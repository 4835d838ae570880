"""Interface types for the observer, and their messages as plain values.

The types are ROS's own, and the contract's from its own build, never a submission's. The contract's can be imported
only where the path leads to that build, as in grader/trials/worker.py. It has the types under one package name: that of
the package in which the submission has them.
"""

from __future__ import annotations

import dataclasses
import importlib
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile

LOG_QOS = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""How nodes publish /rosout. Read like this, it also gives what was logged before the subscription was matched."""

_CAP = 2000  # characters of a string, bytes or items: evidence is not a place to store a novel
_FIELD = re.compile(r"([a-z0-9]+|(?:std|geometry)_msgs/(?:msg/)?[A-Z]\w*)\s+([a-z]\w*)")
_NUMBERS = {f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)} | {"float32", "float64"}
_ROS_NAMES = {"float": "float32", "double": "float64"}  # rclpy's names -> those of .msg files
_READ = "submission/msg/Read"

Reader = Callable[[bytes], dict[str, Any] | None]
"""Returns a message as `messages.plain` does, None for bytes that are not such a message."""


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


def plain(message: Any) -> Any:
    """Return a message as nested dictionaries, lists, numbers and strings."""
    if hasattr(message, "get_fields_and_field_types"):
        return {name: plain(getattr(message, name)) for name in message.get_fields_and_field_types()}
    if dataclasses.is_dataclass(message):  # of rosbags
        names = [field.name for field in dataclasses.fields(message) if not field.name.startswith("__")]
        return {name: plain(getattr(message, name)) for name in names}
    if isinstance(message, str):
        return message[:_CAP]
    if isinstance(message, bool | int | float):
        return message
    if isinstance(message, bytes):
        return message[:_CAP].hex()
    return [plain(item) for item in list(message)[:_CAP]]


def set_back(message: dict[str, Any], seconds: float) -> None:
    """Set the stamp in a plain message's header back, as if the run had begun so many seconds later."""
    match message:
        case {"header": {"stamp": {"sec": int(sec), "nanosec": int(ns)} as stamp}} if seconds:
            stamp["sec"], stamp["nanosec"] = divmod(sec * 1_000_000_000 + ns - round(seconds * 1e9), 1_000_000_000)


def fill(message: Any, fields: dict[str, Any]) -> Any:
    """Return `message` with `fields` set; a dictionary fills a nested message."""
    for name, value in fields.items():
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        else:
            setattr(message, name, value)
    return message


def reader(text: str, contract: Any) -> Reader | None:
    """Return a function that reads messages by the definition `text`, None if the contract's type is to read them.

    A message arrives as bytes. Read in the contract's order, two fields that a submission has exchanged would turn
    right values into wrong ones, and cost the points for the values as well as those for the type. Where the fields are
    the same, or have other names, the contract's type reads: then there is no telling which is which.

    Args:
        text: the submission's .msg file.
        contract: the contract's message class.
    """
    own = _fields(text)
    wanted = {
        name: _ROS_NAMES.get(kind, kind).replace("/msg/", "/")
        for name, kind in contract.get_fields_and_field_types().items()
    }
    if own is None or own.keys() != wanted.keys() or list(own.items()) == list(wanted.items()):
        return None
    if any(kind != wanted[name] and not {kind, wanted[name]} <= _NUMBERS for name, kind in own.items()):
        return None
    return _reader("\n".join(f"{kind} {name}" for name, kind in own.items()))


def _fields(text: str) -> dict[str, str] | None:
    """Return each field's type in the order of the text; None if it has anything but plain fields."""
    found = {}
    for line in text.splitlines():
        code = line.partition("#")[0].strip()
        if not code:
            continue
        field = _FIELD.fullmatch(code)
        if field is None:
            return None
        found[field[2]] = field[1].replace("/msg/", "/")
    return found


@cache
def _reader(definition: str) -> Reader:
    # Imported here: few submissions need it, and workers start often.
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(definition, _READ))

    def read(data: bytes) -> dict[str, Any] | None:
        try:
            return dict(plain(store.deserialize_cdr(data, _READ)))
        except Exception:  # a node may publish any bytes; none of them are an error of ours
            return None

    return read
