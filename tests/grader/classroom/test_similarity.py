"""Which packages are alike: a copy is found with other names, order or files; what the course gives is not."""

from __future__ import annotations

import ast
import itertools
import random
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from helpers.course import COURSE
from submissions.edits import REFERENCE

from grader import cli
from grader.classroom import similarity
from grader.classroom.class_folder import ClassFolder
from grader.classroom.normal_form import normal_form

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


def cut(text: str) -> dict[str, str]:
    """Return a module with a class as two, each with half of the methods."""
    tree = ast.parse(text)
    halves = [ast.parse(text), ast.parse(text)]
    for half, part in zip(halves, (slice(None, 4), slice(4, None)), strict=True):
        for node, whole in zip(half.body, tree.body, strict=True):
            if isinstance(node, ast.ClassDef) and isinstance(whole, ast.ClassDef):
                node.body = node.body[part] or [ast.Pass()]
    return {f"{number}.py": ast.unparse(half) for number, half in enumerate(halves)}


def shares(texts: Mapping[str, Texts], base: Texts | None = None) -> dict[tuple[str, str], float]:
    return {(pair.one, pair.other): pair.share for pair in similarity.compare(texts, base or {}, 100).pairs}


@pytest.mark.parametrize(
    "copy",
    [{"a.py": renamed(DRIVER)}, {"a.py": reordered(DRIVER)}, cut(DRIVER)],
    ids=["other names", "other order", "other files"],
)
def test_a_copy_is_found(copy: Texts):
    found = shares({"copy": copy, "first": {"driver.py": DRIVER}, "own": {"driver.py": PROCESSOR}})
    assert found["copy", "first"] > 0.8
    assert found["copy", "own"] < 0.4
    assert next(iter(found)) == ("copy", "first"), "the most alike come first"


NOTHING = """
pass
0
"nothing"
unused = 1
unused, other = other, unused
unused += len("abc")
if unused:
    other: int = 2
for unused in ():
    pass
while 0:
    print("never")
if False:
    print("never")
import os
def nothing(): ...
try:
    pass
except OSError:
    unused = 1
assert True
""".strip()


class Padded(ast.NodeTransformer):
    """Puts a statement that does nothing after each one of a function."""

    def __init__(self, idle: list[ast.stmt]) -> None:
        self.idle = itertools.cycle(idle)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.body = [part for each in node.body for part in (self.visit(each), next(self.idle))]
        return node


@pytest.mark.parametrize(
    "idle", [*([each] for each in ast.parse(NOTHING).body), ast.parse(NOTHING).body], ids=ast.unparse
)
def test_statements_that_do_nothing_hide_no_copy(idle: list[ast.stmt]):
    copy = ast.unparse(Padded(idle).visit(ast.parse(renamed(DRIVER))))
    found = shares({"copy": {"a.py": copy}, "first": {"driver.py": DRIVER}})
    assert found["copy", "first"] > 0.95


def test_what_is_done_is_compared():
    done = "def f(a):\n    b = a\n    c = b + g()\n    while True:\n        h(c)\n    a.x = 1\n    return a\n"
    assert "".join(part for part, _ in normal_form(done) or []).count("V") == 12


def test_two_files_that_repeat_themselves_are_compared_in_linear_time(monkeypatch):
    """They had 120 KB each and took a minute."""
    work = []
    flatnonzero = np.flatnonzero
    monkeypatch.setattr(np, "flatnonzero", lambda array: work.append(np.size(array)) or flatnonzero(array))
    line, other = "value = read(1)\n", "value = read(1, 2)\n"
    texts = {"one": {"a.py": line * 3000}, "other": {"a.py": (line * 30 + other) * 100}}
    (pair,) = similarity.compare(texts, {}, 10).pairs
    assert pair.share > 0.9
    assert sum(work) < 40 * sum(len(text) for files in texts.values() for text in files.values())


def test_what_was_not_read_is_said(tmp_path: Path, monkeypatch):
    broken = similarity.compare({"one": {"a.py": DRIVER, "b.py": "def f(:\n"}, "other": {"a.py": DRIVER}}, {}, 10)
    assert broken.notes == ("one is compared without b.py, which Python cannot parse.",)
    package = tmp_path / REFERENCE.name
    package.mkdir()
    (package / "package.xml").write_text((REFERENCE / "package.xml").read_text())
    (package / "CMakeLists.txt").write_text("install(PROGRAMS node.txt DESTINATION lib/x RENAME node)\n")
    (package / "program").write_text(f"#!/usr/bin/env python3\n{DRIVER}")
    (package / "node.txt").write_text(f"#!/usr/bin/python3\n{PROCESSOR}")
    (package / "large.py").write_text("x = 1\n" * 50_000)
    read, unread = similarity._python_of(tmp_path, tmp_path / "scratch", COURSE)
    assert sorted(read) == [f"{REFERENCE.name}/node.txt", f"{REFERENCE.name}/program"]
    assert [why.partition(", which")[0] for why in unread] == [f"{REFERENCE.name}/large.py"]


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
    assert "similar.html" in (folder.path / "index.html").read_text()
    printed = capsys.readouterr().out
    assert re.search(r"^boek +\d+%  team07 +\d+%$", printed, re.MULTILINE)
    page = (folder.path / "similar.html").read_text()
    assert "boek (Bo Ek)" in page
    assert re.search(r"driver\.py, lines \d+ to \d+", page)
    assert "<b>" not in page


def test_a_source_that_is_gone_is_named(class_of_four, tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["similar", str(class_of_four().path), "--base", "."]) == 3
    assert "export.zip is neither there nor near the class." in capsys.readouterr().err


def test_a_class_that_was_moved_with_its_submissions_is_still_compared(class_of_four, tmp_path: Path, monkeypatch):
    """The class knew its export only by the path that was given, from the folder in which it was graded."""
    folder: ClassFolder = class_of_four()
    for name in ("boek", "team07"):
        package = tmp_path / "export.zip" / f"{name}.zip" / REFERENCE.name
        package.mkdir(parents=True)
        (package / "package.xml").write_text((REFERENCE / "package.xml").read_text())
        (package / "driver.py").write_text(DRIVER)
    term = tmp_path / "term" / "sheet1"
    term.mkdir(parents=True)
    (tmp_path / "export.zip").rename(term / "export.zip")
    folder.path.rename(term / "class")
    monkeypatch.chdir("/")
    alike = similarity.of_class(ClassFolder(term / "class"), {}, 20)
    assert [(pair.one, pair.other) for pair in alike.pairs] == [("boek", "team07")]
    assert "boek is compared as it is now; it is not what was graded." in alike.notes
