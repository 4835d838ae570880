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
from grader.quality.contract_use import parameter_use
from grader.quality.parsed_module import parse

CONTRACT = list(COURSE.nodes.values())


def test_a_package_without_parameters_gets_nothing(tmp_path: Path):
    """Blatant: 70 % of the real packages that publish a Twist."""
    node = "class RobotController:\n    def control(self):\n        self.max_linear_speed = 0.5\n"
    result = judged(numbers, facts(written(tmp_path, {CONTROLLER: node, PROCESSOR: node})))
    assert result.share == 0.0
    assert "max_linear_speed is not declared in the code" in result.seen


def test_a_parameter_that_is_never_read_costs_its_share(tmp_path: Path):
    """Subtle: the margin is a literal again."""
    text = (REFERENCE / MOTION).read_text()
    text = text.replace("    safety_margin: float\n", "").replace("limits.safety_margin", "0.3")
    result = judged(numbers, facts(reference(tmp_path, files={MOTION: text})))
    assert result.share == pytest.approx(11 / 12)
    assert "safety_margin is declared, and its value is never used" in result.seen


def test_a_byte_order_mark_hides_nothing(tmp_path: Path):
    """As Windows' Notepad writes it: what the module led to was not reached, and eight parameters were not declared."""
    marked = b"\xef\xbb\xbf" + (REFERENCE / NAVIGATOR).read_bytes()
    found = facts(reference(tmp_path, files={NAVIGATOR: marked}))
    assert judged(numbers, found).share == 1.0
    assert found.files == [file for file in untouched().files if not file.path.startswith("test/")]


def test_a_parameter_that_is_not_declared_costs_its_share(tmp_path: Path):
    """Subtle."""
    text = (REFERENCE / PROCESSOR).read_text()
    text = text.replace("    'battery_low_threshold': settings.percentage(20.0),\n", "")
    text = text.replace("self._value('battery_low_threshold')", "20.0")
    result = judged(numbers, facts(reference(tmp_path, files={PROCESSOR: text})))
    assert result.share == pytest.approx(11 / 12)
    assert "sensor_processor: battery_low_threshold is not declared in the code" in result.seen


NAMES = [name for defaults in PARAMETERS.values() for name in defaults]


def declare_and_read_one_by_one() -> str:
    lines = [f"self.declare_parameter('{n}', 1.0)\nself.{n} = self.get_parameter('{n}').value" for n in NAMES]
    return "\n".join([*lines, *[f"f(self.{n})" for n in NAMES]])


def declare_many() -> str:
    table = ", ".join(f"('{n}', 1.0)" for n in NAMES)
    reads = "\n".join(
        f"self.x{i} = self.get_parameter('{n}').get_parameter_value().double_value" for i, n in enumerate(NAMES)
    )
    return f"self.declare_parameters(namespace='', parameters=[{table}])\n{reads}"


def read_what_declare_returns() -> str:
    return "\n".join(f"self.x{i} = self.declare_parameter('{n}', 1.0).value" for i, n in enumerate(NAMES))


def keep_what_declare_returns() -> str:
    return "\n".join(f"p{i} = self.declare_parameter(name='{n}', value=1.0)" for i, n in enumerate(NAMES))


def a_table_and_a_loop_into_attributes() -> str:
    table = ", ".join(f"'{n}': 1.0" for n in NAMES)
    uses = "\n".join(f"print(self.{n})" for n in NAMES)
    loop = "    self.declare_parameter(n, d)\n    setattr(self, n, self.get_parameter(n).value)"
    return f"P = {{{table}}}\nfor n, d in P.items():\n{loop}\n{uses}"


def a_table_and_a_helper() -> str:
    table = ", ".join(f"'{n}': 1.0" for n in NAMES)
    uses = "\n".join(f"f(self.value('{n}'))" for n in NAMES)
    helper = "def value(self, n):\n    return self.get_parameter(n).value"
    return f"P = {{{table}}}\nfor n, d in P.items():\n    self.declare_parameter(n, d)\n{helper}\n{uses}"


def formatted_names() -> str:
    lines = [f"self.x{i} = self.declare_parameter('{n}', 1.0).value" for i, n in enumerate(NAMES) if "battery" not in n]
    lines += ["self.declare_parameter(f'battery_{level}_threshold', 1.0)"]
    return "\n".join([*lines, "self.get_parameter(f'battery_{level}_threshold').value"])


def a_dataclass_that_a_callback_replaces(uses: bool = True) -> str:
    lines = ["class Config:", *[f"    {n}: float = number(1.0)" for n in NAMES], "class Controller(Node):"]
    lines += ["    def __init__(self):", "        self.add_on_set_parameters_callback(self.take)"]
    lines += ["        for entry in fields(Config):", "            self.declare_parameter(entry.name, entry.default)"]
    lines += ["    def take(self, parameters):", "        values = {p.name: p.value for p in parameters}"]
    lines += ["        self.config = replace(self.config, **values)", "    def control(self):", "        pass"]
    return "\n".join([*lines, *[f"        f(self.config.{n})" for n in NAMES if uses]])


def get_parameters() -> str:
    names = ", ".join(f"'{n}'" for n in NAMES)
    declare = "\n".join(f"self.declare_parameter('{n}', 1.0)" for n in NAMES)
    return f"{declare}\nself.values = [p.value for p in self.get_parameters([{names}])]"


@pytest.mark.parametrize(
    "way",
    [
        declare_and_read_one_by_one, declare_many, read_what_declare_returns, keep_what_declare_returns,
        a_table_and_a_loop_into_attributes, a_table_and_a_helper, get_parameters, formatted_names,
        a_dataclass_that_a_callback_replaces,
    ],
)  # fmt: skip
def test_every_honest_way_to_read_parameters_counts(way):
    looks = "\n".join(["f(self.values)", *[f"f(self.x{i})" for i in range(len(NAMES))]])
    uses = parameter_use([parse(CONTROLLER, f"{way()}\n{looks}".encode(), PACKAGE)], CONTRACT)
    assert [use.name for use in uses if not (use.declared and use.read)] == []


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
    (use,) = (
        use for use in parameter_use([parse(CONTROLLER, text.encode(), PACKAGE)], CONTRACT) if use.name == "fusion_rate"
    )
    assert (use.declared, use.read) == (True, used)


def test_a_timer_that_is_made_of_a_parameter_uses_it_though_nothing_looks_at_the_timer():
    text = "self.declare_parameter('fusion_rate', 20.0)\nself.timer = create_timer(1.0 / value('fusion_rate'), f)\n"
    text += "def value(name):\n    return self.get_parameter(name).value\n"
    assert [use.name for use in parameter_use([parse(CONTROLLER, text.encode(), PACKAGE)], CONTRACT) if use.read] == [
        "fusion_rate"
    ]


def test_attributes_that_may_be_looked_at_by_any_name_are_not_charged():
    text = "self.fusion_rate = self.declare_parameter('fusion_rate', 20.0).value\nf(getattr(self, name))"
    assert [use.name for use in parameter_use([parse(CONTROLLER, text.encode(), PACKAGE)], CONTRACT) if use.read] == [
        "fusion_rate"
    ]


def test_a_table_may_be_declared_and_never_read():
    table = ", ".join(f"'{n}': 1.0" for n in NAMES)
    text = f"P = {{{table}}}\nfor n, d in P.items():\n    self.declare_parameter(n, d)\nx = self.get_parameter(y)\n"
    uses = parameter_use([parse(CONTROLLER, text.encode(), PACKAGE)], CONTRACT)
    assert all(use.declared and not use.read for use in uses)


def test_the_field_of_a_dataclass_alone_is_not_a_use():
    uses = parameter_use(
        [parse(CONTROLLER, a_dataclass_that_a_callback_replaces(uses=False).encode(), PACKAGE)], COURSE.nodes.values()
    )
    assert all(use.declared and not use.read for use in uses)


def test_fields_without_a_loop_over_them_are_not_declared():
    text = a_dataclass_that_a_callback_replaces().replace("entry.name", "'robot_name'")
    assert not any(use.declared for use in parameter_use([parse(CONTROLLER, text.encode(), PACKAGE)], CONTRACT))


def test_a_parameter_only_in_a_comment_or_a_test_is_not_declared():
    comment = parse(CONTROLLER, b"# self.declare_parameter('max_linear_speed', 0.5)\n", PACKAGE)
    test = parse("test/test_x.py", b"node.declare_parameter('fusion_rate', 1)\n", PACKAGE)
    assert not any(use.declared for use in parameter_use([comment, test], CONTRACT))
