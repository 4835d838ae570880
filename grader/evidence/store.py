"""Evidence on disk: one folder of JSON files, written and read back without loss."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import replace
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import cattrs

from grader.evidence.model import Evidence
from grader.evidence.trial import Trial

T = TypeVar("T")

_REQUIRED = ("intake", "build", "flags", "functions")


# In an untyped dictionary the string "nan" may come from a student, so a float that JSON lacks is marked as one.
_FLOAT = "$float"


def _plain(value: Any) -> Any:
    """Return `value` with the non-finite floats in untyped dictionaries replaced by marked strings."""
    if isinstance(value, float):
        return value if math.isfinite(value) else {_FLOAT: str(value)}
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _unplain(value: Any) -> Any:
    """Return what `_plain` was given."""
    if isinstance(value, dict):
        return float(value[_FLOAT]) if set(value) == {_FLOAT} else {key: _unplain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_unplain(item) for item in value]
    return value


def _is_frozenset(kind: Any) -> bool:
    return get_origin(kind) is frozenset


_CONVERTER = cattrs.Converter(forbid_extra_keys=True)
# JSON has neither inf nor nan; float() reads back the words that str() writes.
_CONVERTER.register_unstructure_hook(float, lambda value: value if math.isfinite(value) else str(value))
_CONVERTER.register_unstructure_hook_func(lambda kind: kind == dict[str, Any], _plain)
_CONVERTER.register_unstructure_hook_func(_is_frozenset, sorted)
_CONVERTER.register_structure_hook_func(lambda kind: kind == dict[str, Any], lambda value, _: _unplain(dict(value)))

# Without `indent`, with which json encodes in Python and takes almost twice as long.
_ENCODER = json.JSONEncoder(allow_nan=False, sort_keys=True)


def to_data(fact: Any) -> Any:
    """Return `fact` as what JSON can hold: dictionaries, lists, strings and finite numbers."""
    return _CONVERTER.unstructure(fact)


def from_data(data: Any, kind: type[T]) -> T:
    """Return the fact that `to_data` was given.

    Raises:
        ValueError: the data does not describe a `kind`.
    """
    try:
        return _CONVERTER.structure(data, kind)
    except (cattrs.BaseValidationError, AttributeError, TypeError, KeyError) as error:
        raise ValueError(f"not a {getattr(kind, '__name__', kind)}: {error!r}") from error


def to_json(fact: Any) -> str:
    """Return `fact` (a dataclass of evidence, or a list of them) as strict JSON, each item of a list on a line."""
    plain = to_data(fact)
    if not isinstance(plain, dict):
        return _lines(plain)
    return "{\n" + ",\n".join(f"{_ENCODER.encode(key)}: {_lines(plain[key])}" for key in sorted(plain)) + "\n}"


def _lines(value: Any) -> str:
    if not isinstance(value, list) or not value:
        return _ENCODER.encode(value)
    return "[\n" + ",\n".join(map(_ENCODER.encode, value)) + "\n]"


def from_json(text: str, kind: type[T]) -> T:
    """Return the fact that `to_json` wrote.

    Raises:
        ValueError: the text is not JSON, or does not describe a `kind`.
    """
    return from_data(json.loads(text), kind)


def _file(folder: Path, field: str) -> Path:
    """Return where a field of Evidence is, but for the trials, of which each has a file."""
    return folder / f"{'submission' if field == 'intake' else field}.json"


def save(evidence: Evidence, folder: Path) -> None:
    """Write `evidence` below `folder`, one file for each kind of fact."""
    (folder / "trials").mkdir(parents=True, exist_ok=True)
    for field, facts in vars(evidence).items():
        if field != "trials" and (facts or field in (*_REQUIRED, "origin")):
            _file(folder, field).write_text(to_json(facts))
    for trial in evidence.trials.values():
        (folder / "trials" / f"{trial.name}.json").write_text(to_json(trial))


def digest(evidence: Evidence) -> str:
    """Return a hash of all facts, but not of whether and when an earlier grading has collected them."""
    as_new = replace(evidence, kept={}, build=replace(evidence.build, cached=False))
    return hashlib.sha256(to_json(as_new).encode()).hexdigest()


def load(folder: Path) -> Evidence:
    """Read what `save` wrote.

    Raises:
        ValueError: a file is damaged; the message names it.
        OSError: a file cannot be read.
    """
    trials = [_read(path, Trial) for path in sorted((folder / "trials").glob("*.json"))]
    facts: dict[str, Any] = {"trials": {trial.name: trial for trial in trials}}
    for field, kind in get_type_hints(Evidence).items():
        if field in _REQUIRED or (field != "trials" and _file(folder, field).exists()):
            facts[field] = _read(_file(folder, field), get_args(kind)[0] if isinstance(kind, UnionType) else kind)
    return Evidence(**facts)


def _read(path: Path, kind: type[T]) -> T:
    try:
        return from_json(path.read_text(), kind)
    except ValueError as error:
        raise ValueError(f"{path.name} is damaged: {error}") from error
