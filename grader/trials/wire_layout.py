"""Read a message by a submission's own field order, where that differs from the contract's.

A message arrives as bytes, which the contract's type reads in the contract's order. Two fields exchanged would turn
right values into wrong ones, and cost the points for the values as well as those for the type.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from functools import cache
from typing import Any

from grader.trials.messages import plain

_FIELD = re.compile(r"([a-z0-9]+|(?:std|geometry)_msgs/(?:msg/)?[A-Z]\w*)\s+([a-z]\w*)")
_NUMBERS = {f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)} | {"float32", "float64"}
_ROS_NAMES = {"float": "float32", "double": "float64"}  # rclpy's names -> those of .msg files
_NAME = "submission/msg/Read"

Reader = Callable[[bytes], dict[str, Any] | None]
"""Returns a message as `messages.plain` does, None for bytes that are not such a message."""


def reader(text: str, contract: Any) -> Reader | None:
    """Return a function that reads messages by the definition `text`, None if the contract's type is to read them.

    It is where the fields are the same, or have other names: then there is no telling which is which.

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
    store.register(get_types_from_msg(definition, _NAME))

    def read(data: bytes) -> dict[str, Any] | None:
        try:
            return dict(_plain(store.deserialize_cdr(data, _NAME)))
        except Exception:  # a node may publish any bytes; none of them are an error of ours
            return None

    return read


def _plain(value: Any) -> Any:
    if not dataclasses.is_dataclass(value):
        return plain(value)
    names = [field.name for field in dataclasses.fields(value) if not field.name.startswith("__")]
    return {name: _plain(getattr(value, name)) for name in names}
