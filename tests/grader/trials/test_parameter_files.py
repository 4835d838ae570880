"""Values are changed in copies of a package's parameter files, to see whether the files reach the nodes."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from helpers.course import COURSE

from grader.trials import parameter_files


def changed(tmp_path: Path, text: str, names: str = "*.yaml") -> tuple[dict[str, object], dict[str, float]]:
    """Return the parameters in the changed copy of a file with this text, and the values that the trial expects."""
    folder = tmp_path / "config"
    folder.mkdir()
    (folder / "sensor_params.yaml").write_text(text)
    (folder / "robot_params.yaml").write_text("/**:\n  ros__parameters:\n    max_linear_speed: 0.5\n")
    copies, values = parameter_files.write_changed(folder, tmp_path / "out", COURSE.telltales, names)
    copy = next(copy for copy, name in copies.items() if name == "sensor_params.yaml")
    (node,) = yaml.safe_load(copy.read_text()).values()
    return node["ros__parameters"], values


FILE = "sensor_processor:\n  ros__parameters:\n    fusion_frequency: {rate}\n    frame: base_link\n"


def test_known_parameters_of_a_file_are_changed_and_the_rest_stays(tmp_path: Path):
    parameters, values = changed(tmp_path, FILE.format(rate="20.0"))
    assert parameters == {"fusion_frequency": 10.0, "frame": "base_link"}
    assert values == {"fusion_frequency": 10.0, "max_linear_speed": 0.375}


def test_a_trial_of_one_file_expects_the_values_of_that_file_only(tmp_path: Path):
    _, values = changed(tmp_path, FILE.format(rate="20.0"), names="sensor_params.yaml")
    assert values == {"fusion_frequency": 10.0}


def test_an_integer_stays_an_integer(tmp_path: Path):
    """A node that declares an integer rejects a double, and would fail only because of us."""
    parameters, _ = changed(tmp_path, FILE.format(rate="20"))
    assert isinstance(parameters["fusion_frequency"], int)


@pytest.mark.parametrize("value", ["true", "'20.0'", "[20.0]", "null"])
def test_a_value_that_is_not_a_number_is_left_as_it_is(tmp_path: Path, value: str):
    parameters, values = changed(tmp_path, FILE.format(rate=value))
    assert parameters["fusion_frequency"] == yaml.safe_load(value)
    assert "fusion_frequency" not in values


@pytest.mark.parametrize("value", ["!!bool perhaps", "!!int none", "!!timestamp x", "{[1]: 2}", "2024-99-99"])
def test_a_value_that_does_not_fit_its_tag_leaves_the_file_alone(tmp_path: Path, value: str):
    """PyYAML's own errors are not all YAMLErrors."""
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / "a.yaml").write_text(f"ready: {value}\n")
    assert parameter_files.write_changed(tmp_path / "config", tmp_path / "out", COURSE.telltales)[1] == {}


@pytest.mark.parametrize("written", ["2e1", "20."])
def test_a_number_is_what_rcl_takes_for_one(tmp_path: Path, written: str):
    """PyYAML reads `2e1` as a text, and I5 said that no file sets the parameter."""
    parameters, values = changed(tmp_path, FILE.format(rate=written))
    assert parameters["fusion_frequency"] == values["fusion_frequency"] == 10.0


def test_all_else_in_the_file_stays_as_it_is(tmp_path: Path):
    text = FILE.format(rate="20.0   # Hz, quick enough") + "\nsensor_processor:\n  ros__parameters:\n    other: 'yes'\n"
    (tmp_path / "a.yaml").write_text(text)
    copies, _ = parameter_files.write_changed(tmp_path, tmp_path / "out", COURSE.telltales)
    assert next(iter(copies)).read_text() == text.replace("20.0", "10.0")


def test_an_ampersand_in_a_comment_is_not_an_anchor(tmp_path: Path):
    _, values = changed(tmp_path, "# rates & thresholds\n" + FILE.format(rate="20.0"), names="sensor_params.yaml")
    assert values == {"fusion_frequency": 10.0}


def test_a_value_with_an_anchor_is_changed(tmp_path: Path):
    """rcl reads past an anchor."""
    _, values = changed(tmp_path, FILE.format(rate="&usual 20.0"), names="sensor_params.yaml")
    assert values == {"fusion_frequency": 10.0}


def test_a_file_with_aliases_is_left_alone(tmp_path: Path):
    """rcl refuses it."""
    (tmp_path / "big.yaml").write_text("a: &a [1]\nb: [*a, *a]\n")
    assert parameter_files.write_changed(tmp_path, tmp_path / "out", COURSE.telltales) == ({}, {})
