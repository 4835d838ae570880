"""Reading files that a submission may have written."""

from __future__ import annotations

import ast
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.mutation.source_text import parse
from grader.sandbox import untrusted

LINES = (
    "x = 1", "if x:", "    y = 'é'", "\f    z = 2", "    \f  \f    w = x + 1", "# a\fb", "s = x \f+ 2", "", "def f(a):",
    "    return a < 3",
)  # fmt: skip
HEADS = ("", "# -*- coding: latin-1 -*-", "#!/usr/bin/python3\n# vim: set fileencoding=cp1252 :", "\ufeff")


@given(
    lines=st.lists(st.sampled_from(LINES), max_size=12),
    ending=st.sampled_from(["\n", "\r\n", "\r"]),
    head=st.sampled_from(HEADS),
)
def test_a_source_is_read_as_python_reads_it(
    tmp_path_factory: pytest.TempPathFactory, lines: list[str], ending: str, head: str
):
    """And what was read can be written as UTF-8 and is still the same module."""
    path = tmp_path_factory.getbasetemp() / "module.py"
    encoding = "latin-1" if "coding" in head else "utf-8"
    path.write_bytes(ending.join([*head.split("\n"), *lines, ""]).encode(encoding))
    text = untrusted.read_python(path)
    try:
        tree = ast.parse(path.read_bytes())
    except SyntaxError:
        assert text is None or parse("m.py", text) is None
        return
    assert text is not None
    assert ast.dump(ast.parse(text.encode()), include_attributes=False) == ast.dump(tree, include_attributes=False)
    path.write_text(text)
    assert untrusted.read_python(path) == text


@pytest.mark.parametrize("encoding", ["unicode_escape", "utf-7", "idna", "rot13", "no-such-thing"])
def test_unusual_encodings_are_not_read(tmp_path: Path, encoding: str):
    (tmp_path / "m.py").write_text(f"# coding: {encoding}\nx = 1\n")
    assert untrusted.read_python(tmp_path / "m.py") is None


def test_links_pipes_folders_and_long_files_are_not_read(tmp_path: Path):
    (tmp_path / "file").write_text("12")
    (tmp_path / "link").symlink_to("file")
    os.mkfifo(tmp_path / "pipe")  # a plain open() would block here for ever
    assert untrusted.read_text(tmp_path / "file") == "12"
    assert [untrusted.read_text(tmp_path / name) for name in ("link", "pipe", ".", "missing")] == [None] * 4
    assert untrusted.read_text(tmp_path / "file", max_bytes=1) is None


@pytest.mark.parametrize("data", [b"", b"{", b"[" * 100_000, b"\xff\xfe"])
def test_json_that_cannot_be_parsed_is_none(tmp_path: Path, data: bytes):
    (tmp_path / "file").write_bytes(data)
    assert untrusted.read_json(tmp_path / "file") is None
