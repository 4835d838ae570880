"""Values are changed in copies of a package's parameter files, so that one sees whether the files reach the nodes."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from grader.trials import parameter_files


def changed(tmp_path: Path, text: str, names: str = "*.yaml") -> tuple[dict[str, object], dict[str, float]]:
    """Return the parameters in the copy of a file with this text, and which values the trial expects."""
    folder = tmp_path / "config"
    folder.mkdir()
    (folder / "sensor_params.yaml").write_text(text)
    (folder / "robot_params.yaml").write_text("/**:\n  ros__parameters:\n    max_linear_speed: 0.5\n")
    copies, values = parameter_files.write_changed(folder, tmp_path / "out", names)
    copy = next(copy for copy, name in copies.items() if name == "sensor_params.yaml")
    (node,) = yaml.safe_load(copy.read_text()).values()
    return node["ros__parameters"], values


FILE = "sensor_processor:\n  ros__parameters:\n    fusion_frequency: {rate}\n    frame: base_link\n"


def test_what_a_file_sets_is_changed_and_the_rest_stays(tmp_path: Path):
    parameters, values = changed(tmp_path, FILE.format(rate="20.0"))
    assert parameters == {"fusion_frequency": 10.0, "frame": "base_link"}
    assert values == {"fusion_frequency": 10.0, "max_linear_speed": 0.375}


def test_a_node_with_a_file_of_its_own_is_held_to_that_file_only(tmp_path: Path):
    _, values = changed(tmp_path, FILE.format(rate="20.0"), names="sensor_params.yaml")
    assert values == {"fusion_frequency": 10.0}


def test_a_whole_number_stays_one(tmp_path: Path):
    """A node that declares an integer refuses a double, and would be wrong only by our doing."""
    parameters, _ = changed(tmp_path, FILE.format(rate="20"))
    assert isinstance(parameters["fusion_frequency"], int)


@pytest.mark.parametrize("value", ["true", "'20.0'", "[20.0]", "null"])
def test_what_is_no_number_is_left_to_the_node_that_reads_it(tmp_path: Path, value: str):
    parameters, values = changed(tmp_path, FILE.format(rate=value))
    assert parameters["fusion_frequency"] == yaml.safe_load(value)
    assert "fusion_frequency" not in values


def test_a_number_that_can_be_read_and_not_written_back_is_no_fault_of_ours(tmp_path: Path):
    (tmp_path / "big.yaml").write_text(FILE.format(rate="20.0") + f"    big: 0x{'f' * 5000}\n")
    assert parameter_files.write_changed(tmp_path, tmp_path / "out") == ({}, {})


@pytest.mark.parametrize("value", ["!!bool perhaps", "!!int none", "!!timestamp x", "{[1]: 2}", "2024-99-99"])
def test_a_value_that_is_not_what_it_says_leaves_the_file_alone(tmp_path: Path, value: str):
    """PyYAML's own errors are not all YAMLErrors."""
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / "a.yaml").write_text(f"ready: {value}\n")
    assert parameter_files.write_changed(tmp_path / "config", tmp_path / "out")[1] == {}


def test_an_ampersand_in_a_comment_is_no_anchor(tmp_path: Path):
    _, values = changed(tmp_path, "# rates & thresholds\n" + FILE.format(rate="20.0"), names="sensor_params.yaml")
    assert values == {"fusion_frequency": 10.0}


def test_a_file_with_anchors_is_left_alone(tmp_path: Path):
    (tmp_path / "big.yaml").write_text("a: &a [1]\nb: [*a, *a]\n")
    assert parameter_files.write_changed(tmp_path, tmp_path / "out") == ({}, {})
