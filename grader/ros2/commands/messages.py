"""Messages as dictionaries and as YAML, and back."""

from __future__ import annotations

import array
import importlib
import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from operator import attrgetter
from typing import Any

import yaml

from . import Refusal

FULL = 128  # entries of a sequence, or letters of a text, that are shown by default
TITLES = {"msg": "message", "srv": "service"}
_ARRAY = re.compile(r"\]$|^sequence<")


def load(name: str, kind: str) -> Any:
    """Return the class of an interface such as `std_msgs/msg/String`; the middle word may be left out."""
    parts = name.split("/")
    if len(parts) == 2:
        parts.insert(1, kind)
    refusal = f"The passed {TITLES.get(kind, kind)} type is invalid"
    if len(parts) != 3 or not all(parts) or parts[1] != kind:
        raise Refusal(refusal)
    package, _, base = parts
    try:
        module = importlib.import_module(f"{package}.{kind}")
    except ImportError as error:
        raise Refusal(f"{refusal}: {error}") from error
    if (found := getattr(module, base, None)) is None:
        close = get_close_matches(base, [name for name in dir(module) if name[0].isupper()], 1)
        meant = f"; did you mean {package}/{kind}/{close[0]}?" if close else ""
        raise Refusal(f"{refusal}: {package} has no {base}{meant}")
    return found


def prototype(name: str, kind: str) -> Any:
    """Return what a command line fills in for an interface: a message, a service's request or an action's goal."""
    found = load(name, kind)
    return {"msg": found, "srv": getattr(found, "Request", None), "action": getattr(found, "Goal", None)}[kind]()


def hash_text(end: Any) -> str:
    """Return the hash of the type of a publisher or subscription as text."""
    return f"RIHS{end.topic_type_hash.version:02}_{bytes(end.topic_type_hash.value).hex()}"


def to_plain(value: Any, length: int | None = None, arrays: bool = True) -> Any:
    """Return a message, or a value in one, as dictionaries, lists and scalars.

    Of sequences and texts no more than `length` is shown, and of arrays only what they are if not `arrays`.
    """
    if hasattr(value, "get_fields_and_field_types"):
        kinds = value.get_fields_and_field_types()
        found = {name: (getattr(value, name), kind) for name, kind in kinds.items()}
        return {
            name: to_plain(part, length, arrays) if arrays or not _ARRAY.search(kind) else _summary(part, kind)
            for name, (part, kind) in found.items()
        }
    if isinstance(value, bytes):
        value = value.decode("latin-1")  # one letter for each byte
    if isinstance(value, str):
        return value if length is None or len(value) <= length else value[:length] + "..."
    if hasattr(value, "tolist"):  # of array and numpy
        value = value.tolist()
    if isinstance(value, Sequence):
        shown = [to_plain(one, length, arrays) for one in value[:length]]
        return shown if len(shown) == len(value) else [*shown, "..."]
    return value


def _summary(value: Any, kind: str) -> str:
    """Return what is shown of an array or a sequence by `--no-arr`."""
    element, size = re.fullmatch(r"(?:sequence<)?(.*?)(?:(?:, |\[)(\d+)\]?)?>?", kind).groups()  # type: ignore[union-attr]  # matches every text
    element = element.replace("/", "/msg/").partition("<")[0] + (f"[{size}]" if size else "")
    if kind.endswith("]"):
        return f"<array type: {element}>"
    return f"<sequence type: {element}, length: {len(value)}>"


def to_yaml(value: Any, length: int | None = None, arrays: bool = True) -> str:
    """Return a message, or a value in one, as YAML, in the order of the definition."""
    plain = to_plain(value, length, arrays)
    if isinstance(plain, Mapping) and not plain:
        return "{}\n"
    text = yaml.safe_dump(plain, default_flow_style=False, sort_keys=False, allow_unicode=True, width=10**9)
    return text[: -len("...\n")] if text.endswith("\n...\n") else text  # the end mark of a document, not of a long text


def from_yaml(text: str) -> Any:
    """Return the values in a command-line argument, {} for an empty one."""
    try:
        found = yaml.safe_load(text) if text else {}
    except yaml.YAMLError as error:
        raise Refusal(f"The values are not valid YAML: {error}\nTry '{{field: value}}', in quotes.") from error
    if found is None:
        return {}
    if not isinstance(found, dict):
        raise Refusal("The passed value needs to be a dictionary in YAML format")
    return found


def fill(message: Any, values: Mapping[str, Any], now: Any) -> None:
    """Put values into a message; `auto` for a header and `now` for a time mean the present."""
    for name, value in values.items():
        try:
            current = getattr(message, name)
            setattr(message, name, _converted(message, name, current, value, now))
        except (AttributeError, TypeError, ValueError, AssertionError) as error:
            raise Refusal(f"Failed to populate field: {error}") from error


def _converted(message: Any, name: str, current: Any, value: Any, now: Any) -> Any:
    kind = message.get_fields_and_field_types()[name]
    if hasattr(current, "get_fields_and_field_types"):
        if value == "now" and kind == "builtin_interfaces/Time":
            return now
        if value == "auto" and kind == "std_msgs/Header":
            current.stamp = now
            return current
        if not isinstance(value, Mapping):
            raise TypeError(f"{name} is a {kind}, so its value is a dictionary, not {value!r}")
        fill(current, value, now)
        return current
    if isinstance(current, str):
        return str(value)
    if isinstance(current, bytes):
        return bytes(value) if isinstance(value, list) else bytes([int(value)])
    if isinstance(current, array.array | list | tuple) or type(current).__name__ == "ndarray":
        return _sequence(kind, current, value, now)
    return value if isinstance(current, bool) and isinstance(value, bool) else type(current)(value)


def _sequence(kind: str, current: Any, value: Any, now: Any) -> Any:
    if not isinstance(value, list):
        raise TypeError(f"expected a list for {kind}, got {value!r}")
    element = kind.removeprefix("sequence<").split("[")[0].split(",")[0].rstrip(">")
    if "/" in element:
        package, _, base = element.partition("/")
        made = []
        for one in value:
            item = load(f"{package}/msg/{base}", "msg")()
            fill(item, one, now)
            made.append(item)
        return made
    if element in ("float", "double"):
        value = [float(one) for one in value]
    elif element.startswith(("string", "wstring")):
        value = [str(one) for one in value]
    elif element == "octet":
        value = [one if isinstance(one, bytes) else bytes([one]) for one in value]
    if type(current).__name__ == "ndarray":
        import numpy as np

        return np.array(value, dtype=current.dtype)
    return array.array(current.typecode, value) if isinstance(current, array.array) else value


def field(message: Any, path: str) -> Any:
    """Return the part of a message at a path such as `linear.x`; like the real command, it knows no `ranges[0]`."""
    try:
        return attrgetter(path.strip("."))(message)
    except AttributeError as error:
        raise Refusal(f"Invalid field '{path}': {error}") from error
