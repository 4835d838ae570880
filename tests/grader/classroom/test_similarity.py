"""Which packages are alike: a copy is found with other names, order or files; what the course gives is not."""

from __future__ import annotations

import ast
import random
import re
from collections.abc import Mapping
from pathlib import Path

import pytest
from submissions.edits import REFERENCE

from grader import cli
from grader.classroom import similarity
from grader.classroom.class_folder import ClassFolder

pytest.importorskip("copydetect", reason="needs copydetect: make setup")

Texts = Mapping[str, str]


def module(name: str) -> str:
    return (REFERENCE / REFERENCE.name / name).read_text()


DRIVER, NAVIGATOR, PROCESSOR = module("driver.py"), module("navigator.py"), module("sensor_processor.py")


def renamed(text: str) -> str:
    """Return a text in which every name that it defines is another one."""
    tree = ast.parse(text)
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    names |= {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    for number, name in enumerate(sorted(names - {"__init__"})):
        text = re.sub(rf"\b{name}\b", f"a_name_{number}", text)
    return text


def reordered(text: str) -> str:
    """Return a text without comments, with its methods in another order."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            random.Random(1).shuffle(node.body)
    return ast.unparse(tree)


def shares(texts: Mapping[str, Texts], base: Texts | None = None) -> dict[tuple[str, str], float]:
    return {(pair.one, pair.other): pair.share for pair in similarity.compare(texts, base or {}, 100).pairs}


@pytest.mark.parametrize(
    "copy",
    [{"a.py": renamed(DRIVER)}, {"a.py": reordered(DRIVER)}, {"a.py": DRIVER[:2500], "b.py": DRIVER[2500:]}],
    ids=["other names", "other order", "other files"],
)
def test_a_copy_is_found(copy: Texts):
    found = shares({"copy": copy, "first": {"driver.py": DRIVER}, "own": {"driver.py": PROCESSOR}})
    assert found["copy", "first"] > 0.8
    assert found["copy", "own"] < 0.4
    assert next(iter(found)) == ("copy", "first"), "the most alike come first"


def test_what_the_course_gives_does_not_count():
    both = {"one": {"a.py": DRIVER, "b.py": NAVIGATOR}, "other": {"a.py": DRIVER, "b.py": PROCESSOR}}
    assert shares(both)["one", "other"] > 0.5
    assert shares(both, {"given.py": DRIVER})["one", "other"] < 0.3


def test_who_has_nothing_of_their_own_is_not_compared():
    alike = similarity.compare({"one": {"a.py": DRIVER}, "other": {"a.py": NAVIGATOR}}, {"given.py": DRIVER}, 10)
    assert alike.compared == 0
    assert alike.notes == ("one is not compared: it has hardly any Python beyond what the course gives.",)


def test_the_places_are_the_same_lines_of_both():
    shifted = "import math\n\n\n" + renamed(DRIVER)
    (pair,) = similarity.compare({"one": {"a.py": DRIVER}, "other": {"b.py": shifted}}, {}, 10).pairs
    one, other = pair.places[0]
    assert (one.path, other.path) == ("a.py", "b.py")
    assert other.first - one.first == other.last - one.last == 3
    assert one.text == "\n".join(DRIVER.splitlines()[one.first - 1 : one.last][:60]) or "more lines" in one.text


def test_the_command_reads_a_class_and_writes_a_page(class_of_four, tmp_path: Path, monkeypatch, capsys):
    """boek and team07 hand in the same package; the class names its source as it was given."""
    folder: ClassFolder = class_of_four()
    for name in ("boek", "team07"):
        package = tmp_path / "export" / f"{name}.zip" / REFERENCE.name
        package.mkdir(parents=True)
        (package / "package.xml").write_text((REFERENCE / "package.xml").read_text())
        (package / "setup.py").write_text("")
        (package / "driver.py").write_text(DRIVER + f"\nEND = '<b>{name}'\n")
    (tmp_path / "export").rename(tmp_path / "export.zip")
    (tmp_path / "base").mkdir()
    monkeypatch.chdir(tmp_path)
    assert cli.main(["similar", str(folder.path), "--base", "base"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"^boek +\d+%  team07 +\d+%$", printed, re.MULTILINE)
    page = (folder.path / "similar.html").read_text()
    assert "boek (Bo Ek)" in page
    assert "driver.py, lines 1" in page
    assert "<b>" not in page


def test_a_source_that_is_gone_is_named(class_of_four, tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["similar", str(class_of_four().path), "--base", "."]) == 3
    assert "export.zip is not there. Run this in the folder" in capsys.readouterr().err
