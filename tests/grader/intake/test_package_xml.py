"""Reading package.xml: the fields, and no entities."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.intake.package_xml import read_package_xml


def test_entities_are_refused_rather_than_expanded(tmp_path: Path):
    bomb = "<!DOCTYPE p [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;'>]><package><name>&b;</name></package>"
    for data in (bomb.encode(), "<!DOCTYPE p SYSTEM '/etc/passwd'><package/>".encode("utf-16")):
        (tmp_path / "package.xml").write_bytes(data)
        assert read_package_xml(tmp_path / "package.xml").problem == "declares a DOCTYPE, which is not allowed"


def test_the_fields_of_package_xml_are_read(tmp_path: Path):
    text = (
        "<?xml version='1.0'?><?xml-model href='x'?><package format='3'><name> a_b </name><depend>rclpy</depend>"
        "<export><build_type>ament_cmake</build_type></export></package>"
    )
    (tmp_path / "package.xml").write_text(text)
    read = read_package_xml(tmp_path / "package.xml")
    assert (read.name, read.format, read.build_type, read.texts("depend")) == ("a_b", "3", "ament_cmake", ["rclpy"])


@pytest.mark.parametrize(
    ("condition", "is_read"),
    [("$ROS_VERSION == 2", True), ("$ROS_VERSION == 1", False), ("$ROS_DISTRO == humble", False), ("what?", True),
     ("(" * 5000, True)],
)  # fmt: skip
def test_what_a_false_condition_leaves_out_is_not_declared(tmp_path: Path, condition: str, is_read: bool):
    text = f"""<package><depend condition="{condition}">nav_msgs</depend><export>
      <build_type condition="{condition}">ament_cmake</build_type></export></package>"""
    (tmp_path / "package.xml").write_text(text)
    read = read_package_xml(tmp_path / "package.xml")
    assert (read.texts("depend"), read.build_type) == ((["nav_msgs"], "ament_cmake") if is_read else ([], ""))


@given(st.binary(max_size=300))
@settings(max_examples=200)
def test_any_bytes_as_package_xml_give_an_answer(data: bytes):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "package.xml")
        for content in (data, b"<?xml version='1.0' encoding='" + data[:20] + b"'?><package/>"):
            path.write_bytes(content)
            read_package_xml(path)
