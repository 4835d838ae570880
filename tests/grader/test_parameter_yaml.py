"""Parameter files of ROS are read as rcl reads them: the same files are refused, and values have the same types."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml

from grader.yaml_reader import ParameterFileError, parameter_blocks, scalar_of

VALUES: dict[str, object] = {
    "1": 1, "1.0": 1.0, "1e3": 1000.0, "1.": 1.0, "-.5": -0.5, ".5": 0.5, "+1": 1, "0x10": 16, "010": 8, "08": 8.0,
    "0o10": "0o10", "1_000": "1_000", "12:30": "12:30", "2026-01-01": "2026-01-01", "yes": True, "Y": True,
    "off": False, "TRUE": True, "tRUE": "tRUE", "null": "null", "~": "~", ".inf": math.inf, "-.inf": -math.inf,
    "infinity": math.inf, "'1.0'": "1.0", "'false'": "false", "0,25": "0,25", "1.0,": "1.0,", "1.0;": "1.0;",
    "0.25m": "0.25m", "50%": "50%",
    "99999999999999999999": 1e20, "1e400": "1e400", "0x1p3": 8.0, "1.5d": "1.5d", "&a 1.0": 1.0, "\t1.0": 1.0,
    "|\n      text": "text\n",
}  # fmt: skip
"""What is written for a value, and what a node gets."""

REFUSED = {
    "": ("n:\n  ros__parameters:\n    p:\n", 3, "`p:` has no value"),
    "block not indented": ("n:\nros__parameters:\n  p: 1.0\n", 1, "is below `n:`"),
    "values not indented": ("n:\n  ros__parameters:\n  p: 1.0\n", 2, "is below `ros__parameters:`"),
    "no node": ("ros__parameters:\n  p: 1.0\n", 1, "no node's name is above"),
    "no block": ("n:\n  p: 1.0\n", 2, "`p` is not below a `ros__parameters:`"),
    "one underscore": ("n:\n  ros_parameters:\n    p: 1.0\n", 2, "with two underscores"),
    "capital": ("n:\n  Ros__parameters:\n    p: 1.0\n", 2, "has to be `ros__parameters:`"),
    "tab": ("n:\n\tros__parameters:\n\t\tp: 1.0\n", 2, "a tab"),
    "no blank": ("n:\n  ros__parameters:\n    p:1.0\n", 2, "a name and a value is below"),
    "no blank, then more": ("n:\n  ros__parameters:\n    p:1.0\n    q: 2.0\n", 3, "behind `p`"),
    "no blank at the end": ("n:\n  ros__parameters:\n    q: 2.0\n    p:1.0\n", 4, "behind `p`"),
    "equals": ("n:\n  ros__parameters:\n    p = 1.0\n", 2, "a name and a value is below"),
    "too deep": ("n:\n  ros__parameters:\n    p: 1.0\n     q: 2.0\n", 4, "it is not YAML"),
    "between": ("n:\n  ros__parameters:\n    p: 1.0\n   q: 2.0\n", 4, "it is not YAML"),
    "nothing below": ("n:\n  ros__parameters:\n", 2, "is below `ros__parameters:`"),
    "beside the block": ("n:\n  ros__parameters:\n    p: 1.0\n  q: 2.0\n", 4, "`q` is not below"),
    "a list of nodes": ("- n:\n    ros__parameters:\n      p: 1.0\n", 1, "it is a list"),
    "alias": ("n:\n  ros__parameters:\n    p: &a 1.0\n    q: *a\n", 4, "no alias such as `*a`"),
    "no end of a text": ("n:\n  ros__parameters:\n    p: 'abc\n", 4, "it is not YAML"),
    "two colons": ("n:\n  ros__parameters:\n    p: a: b\n", 3, "it is not YAML"),
    "int among floats": ("n:\n  ros__parameters:\n    p: [1.0, 2]\n", 3, "mixes types: float, int"),
    "text among ints": ("n:\n  ros__parameters:\n    p: [1, a]\n", 3, "mixes types: int, str"),
    "lists in a list": ("n:\n  ros__parameters:\n    p: [[1, 2], [3]]\n", 3, "a list of lists"),
}
"""What rcl refuses, with the line to look at and what is said of it."""

ACCEPTED = {
    "slash": ("/n:\n  ros__parameters:\n    p: 1.0\n", {"p": 1.0}),
    "any node": ("/**:\n  ros__parameters:\n    p: 1.0\n", {"p": 1.0}),
    "any namespace": ("/**/n:\n  ros__parameters:\n    p: 1.0\n", {"p": 1.0}),
    "in levels": ("/:\n  n:\n    ros__parameters:\n      p: 1.0\n", {"p": 1.0}),
    "the last of two": ("n:\n  ros__parameters:\n    p: 1.0\n    p: 2.0\n", {"p": 2.0}),
    "a node twice": ("n:\n  ros__parameters:\n    p: 1.0\nn:\n  ros__parameters:\n    q: 2.0\n", {"p": 1.0, "q": 2.0}),
    "two documents": ("n:\n  ros__parameters:\n    p: 1\n---\nn:\n  ros__parameters:\n    q: 2\n", {"p": 1, "q": 2}),
    "nested": ("n:\n  ros__parameters:\n    a:\n      b: 1.0\n", {"a.b": 1.0}),
    "lines of Windows": ("n:\r\n  ros__parameters:\r\n    p: 1.0\r\n", {"p": 1.0}),
    "blank before the colon": ("n:\n  ros__parameters :\n    p : 1.0\n", {"p": 1.0}),
    "empty": ("# nothing yet\n", {}),
}  # fmt: skip


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
