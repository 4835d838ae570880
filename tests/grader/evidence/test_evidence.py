"""Evidence: what is saved is what is read back, infinities and all; what is damaged is named."""

import json
import math
from dataclasses import fields, is_dataclass
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grader import evidence
from grader.evidence import (
    Build,
    Call,
    Evidence,
    Flag,
    Goal,
    Intake,
    Message,
    Sample,
    StudentTests,
    Trial,
    from_json,
    to_json,
)

FLOATS = st.floats(allow_nan=True, allow_infinity=True)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | FLOATS | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
).filter(lambda value: "$float" not in repr(value))
st.register_type_strategy(float, FLOATS)
UNTYPED = st.dictionaries(st.text(max_size=8), PLAIN, max_size=4).filter(lambda value: "$float" not in value)

INTAKE = Intake("team07.zip", "ab" * 32, "ros2_robot_controller", "team07", notes=["one folder too deep"])
BUILD = Build(True, False, 14.2, 0, False, "Finished", type_hashes={"srv/SetSpeed": "RIHS01_00"})


def facts(kind):
    """Return a strategy for dataclasses of evidence, any float in any place."""
    known: dict[str, Any] = {"request": UNTYPED, "data": UNTYPED, "response": st.none() | UNTYPED}
    return st.builds(kind, **{f.name: known[f.name] for f in fields(kind) if f.name in known})


def same(a, b):
    """Compare as ==, but NaN equals NaN, and a type is kept."""
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return a == b or (math.isnan(a) and math.isnan(b))
    if is_dataclass(a):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b


def strict(text):
    """Read JSON as a reader that knows no NaN does."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.mark.parametrize("kind", [Sample, Call, Goal, Message, Build, Intake, Flag, StudentTests])
@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_a_fact_comes_back_as_it_was(kind, data):
    fact = data.draw(facts(kind))
    text = to_json(fact)
    strict(text)
    assert same(from_json(text, kind), fact)


def test_infinity_and_nan_come_back_as_numbers():
    """In typed places and in a service's untyped fields alike, where a string "nan" must stay a string."""
    call = Call(1.0, "set_speed", {"speed": math.nan, "words": ["nan", math.inf]}, {"speed": -math.inf})
    read = from_json(to_json(call), Call)
    assert math.isnan(read.request["speed"])
    assert read.request["words"] == ["nan", math.inf]
    assert read.response == {"speed": -math.inf}


def test_a_saved_grading_is_loaded_as_it_was(tmp_path):
    trial = Trial("wall", "robot_controller", "wall_ahead", 7, True, "lockstep", None, choices={"speed": 0.375})
    goal = Goal(0.1, 1.0, 2.0, 0.15, True, "succeeded", True, 1.0, 2.0, 8.0, feedback=[[0.5, math.inf]])
    flags = [Flag("network", "tried", "setup.py")]
    driven = Trial("goal", "robot_controller", "open_field", 7, True, "lockstep", None, goals=[goal])
    whole = Evidence(INTAKE, BUILD, StudentTests(note="none"), {"goal": driven, "wall": trial}, flags)
    evidence.save(whole, tmp_path)
    assert same(evidence.load(tmp_path), whole)
    names = sorted(str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*.json"))
    files = ["build", "flags", "functions", "origin", "submission", "tests", "trials/goal", "trials/wall"]
    assert names == [f"{name}.json" for name in files]


@pytest.mark.parametrize("file", ["submission.json", "build.json", "flags.json"])
@pytest.mark.parametrize("text", ["", "{", "[1]", '{"surprise": 1}', "null"])
def test_a_damaged_file_is_named(tmp_path, file, text):
    evidence.save(Evidence(INTAKE, BUILD), tmp_path)
    assert evidence.load(tmp_path) == Evidence(INTAKE, BUILD), "without own tests or trials"
    (tmp_path / file).write_text(text)
    with pytest.raises(ValueError, match=f"{file} is damaged"):
        evidence.load(tmp_path)


def test_a_key_too_many_is_refused():
    """A field that is silently dropped would be evidence that no check ever sees."""
    text = json.dumps({"kind": "network", "what": "tried", "where": "", "points": 100})
    with pytest.raises(ValueError, match="not a Flag"):
        from_json(text, Flag)
