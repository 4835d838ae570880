"""Parameter files of ROS are read as rcl reads them: the same files are refused, and values have the same types."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml
from helpers import beside

from grader.yaml_reader import ParameterFileError, parameter_blocks, scalar_of

TEXTS = beside(__file__)

VALUES: dict[str, object] = {
    "1": 1, "1.0": 1.0, "1e3": 1000.0, "1.": 1.0, "-.5": -0.5, ".5": 0.5, "+1": 1, "0x10": 16, "010": 8, "08": 8.0,
    "0o10": "0o10", "1_000": "1_000", "12:30": "12:30", "2026-01-01": "2026-01-01", "yes": True, "Y": True,
    "off": False, "TRUE": True, "tRUE": "tRUE", "null": "null", "~": "~", ".inf": math.inf, "-.inf": -math.inf,
    "infinity": math.inf, "'1.0'": "1.0", "'false'": "false", "0,25": "0,25", "1.0,": "1.0,", "1.0;": "1.0;",
    "0.25m": "0.25m", "50%": "50%",
    "99999999999999999999": 1e20, "1e400": "1e400", "1.5d": "1.5d", "&a 1.0": 1.0, "\t1.0": 1.0,
    "|\n      text": "text\n",
}  # fmt: skip
"""What is written for a value, and what a node gets."""

REFUSED = TEXTS["REFUSED"]
"""What rcl refuses, with the line to look at and what is said of it."""

ACCEPTED = TEXTS["ACCEPTED"]  # fmt: skip


def block(value: str) -> str:
    return f"n:\n  ros__parameters:\n    p: {value}\n"


def read(text: str) -> dict[str, object]:
    nodes = [pair for found in parameter_blocks(text) for pair in found.values.items()]
    return {name: scalar_of(node) for name, node in nodes if isinstance(node, yaml.ScalarNode)}


@pytest.mark.parametrize("written", VALUES)
def test_a_value_has_the_type_that_rcl_gives_it(written: str):
    value = read(block(written))["p"]
    assert (type(value), value) == (type(VALUES[written]), VALUES[written])


@pytest.mark.parametrize("slip", REFUSED)
def test_what_rcl_refuses_is_named_with_its_line(slip: str):
    text, line, words = REFUSED[slip]
    with pytest.raises(ParameterFileError) as refused:
        parameter_blocks(text)
    assert refused.value.line == line
    assert words in refused.value.problem
    assert refused.value.cure


@pytest.mark.parametrize("form", ACCEPTED)
def test_every_form_that_rcl_accepts_is_read(form: str):
    text, values = ACCEPTED[form]
    assert read(text) == values


def test_a_number_beyond_all_bounds_is_a_text():
    assert read(block(f"0x{'f' * 5000}"))["p"] == f"0x{'f' * 5000}"


@pytest.mark.ros
def test_rcl_itself_agrees_with_these_tables(tmp_path: Path):
    import rclpy
    from rclpy.context import Context

    def by_rcl(text: str) -> dict[str, object] | None:
        file, context = tmp_path / "p.yaml", Context()
        file.write_bytes(text.encode())
        try:
            context.init(args=["--ros-args", "--params-file", str(file)])
        except Exception:
            return None
        node = rclpy.create_node(
            "n", context=context, automatically_declare_parameters_from_overrides=True,
            start_parameter_services=False, enable_rosout=False,
        )  # fmt: skip
        found = {name: node.get_parameter(name).value for name in ("p", "q", "a.b") if node.has_parameter(name)}
        node.destroy_node()
        context.try_shutdown()
        return found

    assert {written: by_rcl(block(written)) for written in VALUES} == {w: {"p": v} for w, v in VALUES.items()}
    assert {slip: by_rcl(text) for slip, (text, *_) in REFUSED.items()} == dict.fromkeys(REFUSED)
    assert {form: by_rcl(text) for form, (text, _) in ACCEPTED.items()} == {f: v for f, (_, v) in ACCEPTED.items()}
