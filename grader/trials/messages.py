"""Turn ROS messages into plain values for the evidence, and plain values into requests."""

from __future__ import annotations

from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile

LOG_QOS = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""How nodes publish /rosout. Read like this, it also gives what was logged before the subscription was matched."""

_CAP = 2000  # characters of a string, bytes or items: evidence is not a place to store a novel


def plain(message: Any) -> Any:
    """Return a message as nested dictionaries, lists, numbers and strings."""
    if hasattr(message, "get_fields_and_field_types"):
        return {name: plain(getattr(message, name)) for name in message.get_fields_and_field_types()}
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
