"""Which packages are alike: a copy is found with other names, order or files; what the course gives is not."""

from __future__ import annotations

import ast
import random
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest
from submissions.edits import REFERENCE

from grader import cli
from grader.classroom import similarity
from grader.classroom.class_folder import ClassFolder

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
    return {(pair.one, pair.other): pair.share for pair in similarity.compare(texts, base or {})}


@pytest.mark.parametrize(
    "copy",
    [
        {"a.py": renamed(DRIVER)},
        {"a.py": reordered(DRIVER)},
        {f"{at}.py": part for at, part in enumerate(DRIVER.split("\n\n\n"))},
    ],
    ids=["other names", "other order", "other files"],
)
def test_a_copy_is_found(copy: Texts):
    found = shares({"copy": copy, "first": {"driver.py": DRIVER}, "own": {"driver.py": PROCESSOR}})
    assert found["copy", "first"] > 0.7
    assert found["copy", "own"] < 0.3
    assert next(iter(found)) == ("copy", "first"), "the most alike come first"


def test_what_the_course_gives_does_not_count():
    both = {"one": {"a.py": DRIVER, "b.py": NAVIGATOR}, "other": {"a.py": DRIVER, "b.py": PROCESSOR}}
    assert shares(both)["one", "other"] > 0.4
    assert shares(both, {"given.py": DRIVER})["one", "other"] < 0.2


def test_who_has_nothing_of_their_own_is_not_compared():
    assert shares({"one": {"a.py": DRIVER}, "other": {"a.py": NAVIGATOR}}, {"given.py": DRIVER}) == {}


def test_where_most_of_it_is_is_said():
    (pair,) = similarity.compare(
        {"one": {"a.py": DRIVER}, "other": {"b.py": "import math\n\n\n" + renamed(DRIVER)}}, {}
    )
    path, first, to, last = pair.places.split(", ")[0].split()
    assert (path, to) == ("a.py", "to")
    assert int(last) - int(first) > 20


def test_the_command_compares_a_class_and_writes_an_archive(class_of_four, tmp_path: Path, monkeypatch, capsys):
    """boek and team07 hand in the same package; the class names its source as it was given."""
    folder: ClassFolder = class_of_four()
    for name in ("boek", "team07"):
        package = tmp_path / "export.zip" / f"{name}.zip" / REFERENCE.name
        package.mkdir(parents=True)
        (package / "package.xml").write_text((REFERENCE / "package.xml").read_text())
        (package / "driver.py").write_text(DRIVER)
        (package / "broken.py").write_text("def f(:\n  '''")
    (tmp_path / "base").mkdir()
    (tmp_path / "base" / "given.py").write_text("GIVEN = 1\n")
    monkeypatch.chdir(tmp_path)
    assert cli.main(["similar", str(folder.path), "--base", "base", "--archive", "class.zip"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"^boek +100%  team07 +100%  driver\.py \d+ to \d+", printed, re.MULTILINE)
    assert "boek is compared without broken.py." in printed
    assert "boek is compared as it is now; it is not what was graded." in printed
    assert "Alike" in (folder.path / "index.html").read_text()
    with zipfile.ZipFile(tmp_path / "class.zip") as made:
        assert set(made.namelist()) == {"boek/boek.py", "team07/team07.py", "_given/_given.py"}
        assert made.read("boek/boek.py").decode() == f"# driver.py\n{DRIVER}"


def test_a_source_that_is_gone_is_named(class_of_four, tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["similar", str(class_of_four().path), "--base", "."]) == 3
    assert "There is no export.zip." in capsys.readouterr().err
