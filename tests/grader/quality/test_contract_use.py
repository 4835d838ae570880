"""Q4: the numbers that the contract names as parameters."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.course import COURSE, PACKAGE, PARAMETERS
from helpers.quality_examples import (
    CONTROLLER,
    MOTION,
    NAVIGATOR,
    PROCESSOR,
    REFERENCE,
    facts,
    judged,
    reference,
    untouched,
    written,
)

from grader.courses.robot_controller.checks.check_habits import test_contract_numbers_are_parameters as numbers
from grader.evidence import ParameterUse
from grader.quality.contract_use import parameter_use
from grader.quality.parsed_module import parse

CONTRACT = list(COURSE.nodes.values())


NAMES = [name for defaults in PARAMETERS.values() for name in defaults]


def uses(text: str) -> list[ParameterUse]:
    return parameter_use([parse(CONTROLLER, text.encode(), PACKAGE)], CONTRACT)


def test_a_package_without_parameters_gets_nothing(tmp_path: Path):
    """Such are 70 % of the real packages that publish a Twist."""
    node = "class RobotController:\n    def control(self):\n        self.max_linear_speed = 0.5\n"
    result = judged(numbers, facts(written(tmp_path, {CONTROLLER: node, PROCESSOR: node})))
    assert result.share == 0.0
    assert "max_linear_speed is not declared in the code" in result.seen


@pytest.mark.parametrize(
    ("file", "edits", "said"),
    [
        (MOTION, {"    safety_margin: float\n": "", "limits.safety_margin": "0.3"},
         "safety_margin is declared, and its value is never used"),
        (PROCESSOR, {"    'battery_low_threshold': settings.percentage(20.0),\n": "",
                     "self._value('battery_low_threshold')": "20.0"},
         "sensor_processor: battery_low_threshold is not declared in the code"),
    ],
    ids=["never read", "not declared"],
)  # fmt: skip
def test_a_number_in_a_parameters_place_costs_its_share(tmp_path: Path, file: str, edits: dict[str, str], said: str):
    text = (REFERENCE / file).read_text()
    for old, new in edits.items():
        text = text.replace(old, new)
    result = judged(numbers, facts(reference(tmp_path, files={file: text})))
    assert result.share == pytest.approx(11 / 12)
    assert said in result.seen


def test_a_byte_order_mark_hides_nothing(tmp_path: Path):
    """As Windows' Notepad writes it: what the module led to was not reached, and eight parameters were not declared."""
    marked = b"\xef\xbb\xbf" + (REFERENCE / NAVIGATOR).read_bytes()
    found = facts(reference(tmp_path, files={NAVIGATOR: marked}))
    assert judged(numbers, found).share == 1.0
    assert found.files == [file for file in untouched().files if not file.path.startswith("test/")]


def each(line: str, names: list[str] = NAMES) -> str:
    """Return a line for each of the names."""
    return "".join(line.format(n=name, i=number) + "\n" for number, name in enumerate(names))


QUOTED = [f"'{name}'" for name in NAMES]
TABLE = f"P = {dict.fromkeys(NAMES, 1.0)}\nfor n, d in P.items():\n    self.declare_parameter(n, d)\n"
PARTS = [name for name in NAMES if "battery" not in name]
CLASS = f"""class Config:
{each("    {n}: float = number(1.0)")}
class Controller(Node):
    def __init__(self):
        self.add_on_set_parameters_callback(self.take)
        for entry in fields(Config):
            self.declare_parameter(entry.name, entry.default)
    def take(self, parameters):
        values = {{p.name: p.value for p in parameters}}
        self.config = replace(self.config, **values)
    def control(self):
        pass
"""
CLASS_THAT_IS_USED = CLASS + each("        f(self.config.{n})")


@pytest.mark.parametrize(
    "way",
    [
        each("self.declare_parameter('{n}', 1.0)\nself.{n} = self.get_parameter('{n}').value\nf(self.{n})"),
        f"self.declare_parameters(namespace='', parameters=[{', '.join(f'({name}, 1.0)' for name in QUOTED)}])\n"
        + each("self.x{i} = self.get_parameter('{n}').get_parameter_value().double_value"),
        each("self.x{i} = self.declare_parameter('{n}', 1.0).value"),
        each("p{i} = self.declare_parameter(name='{n}', value=1.0)"),
        TABLE + "    setattr(self, n, self.get_parameter(n).value)\n" + each("print(self.{n})"),
        TABLE + "def value(self, n):\n    return self.get_parameter(n).value\n" + each("f(self.value('{n}'))"),
        each("self.declare_parameter('{n}', 1.0)")
        + f"self.values = [p.value for p in self.get_parameters([{', '.join(QUOTED)}])]\n",
        each("self.x{i} = self.declare_parameter('{n}', 1.0).value", PARTS)
        + "self.declare_parameter(f'battery_{level}_threshold', 1.0)\n"
        + "self.get_parameter(f'battery_{level}_threshold').value\n",
        CLASS_THAT_IS_USED,
    ],
    ids=[
        "one by one", "many at once", "what declaring returns", "it is kept", "a table into attributes",
        "a table and a helper", "get_parameters", "formatted names", "a dataclass that a callback replaces",
    ],
)  # fmt: skip
def test_every_honest_way_to_read_parameters_counts(way: str):
    looks = "f(self.values)\n" + each("f(self.x{i})")
    assert [use.name for use in uses(f"{way}\n{looks}") if not (use.declared and use.read)] == []


@pytest.mark.parametrize(
    "read",
    [
        "self.declare_parameter('fusion_rate', 20.0)\nself.rate = self.get_parameter('fusion_rate').value",
        "self.rate = self.declare_parameter('fusion_rate', 20.0).value",
        "self.declare_parameter('fusion_rate', 20.0)\nself.get_parameter(n)\n'fusion_rate' in changed",
    ],
)
@pytest.mark.parametrize("used", [True, False])
def test_a_value_that_is_kept_and_never_looked_at_is_not_read(read: str, used: bool):
    """Most often so is `fusion_rate`: read into an attribute, and the timer has a number."""
    text = f"{read}\nf({'self.rate' if used else '0.05'})"
    if "changed" in read:
        text += "\nself.value('fusion_rate')" * used
    (use,) = (use for use in uses(text) if use.name == "fusion_rate")
    assert (use.declared, use.read) == (True, used)


TIMER = "self.declare_parameter('fusion_rate', 20.0)\nself.timer = create_timer(1.0 / value('fusion_rate'), f)\n"


@pytest.mark.parametrize(
    "text",
    [
        TIMER + "def value(name):\n    return self.get_parameter(name).value\n",
        "self.fusion_rate = self.declare_parameter('fusion_rate', 20.0).value\nf(getattr(self, name))",
    ],
    ids=["a timer that is made of it", "an attribute that may be looked at by any name"],
)
def test_what_may_use_a_parameter_uses_it(text: str):
    assert [use.name for use in uses(text) if use.read] == ["fusion_rate"]


@pytest.mark.parametrize("text", [TABLE + "x = self.get_parameter(y)\n", CLASS], ids=["a table", "a dataclass"])
def test_a_name_in_a_table_alone_is_declared_and_never_read(text: str):
    assert all(use.declared and not use.read for use in uses(text))


def test_names_that_no_node_declares_are_not_declared():
    """Fields without a loop over them; a comment, and a test."""
    fields = parse(CONTROLLER, CLASS_THAT_IS_USED.replace("entry.name", "'robot_name'").encode(), PACKAGE)
    comment = parse(CONTROLLER, b"# self.declare_parameter('max_linear_speed', 0.5)\n", PACKAGE)
    test = parse("test/test_x.py", b"node.declare_parameter('fusion_rate', 1)\n", PACKAGE)
    for modules in ([fields], [comment, test]):
        assert not any(use.declared for use in parameter_use(modules, CONTRACT))
