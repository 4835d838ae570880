"""The pages name only what exists: files, make targets, verbs of the grader, other pages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader import KIT
from grader.cli import _parser

PAGES = [page for page in sorted([*KIT.glob("*.md"), *(KIT / "docs").glob("*.md")]) if page.name != "CHANGELOG.md"]
PATH = re.compile(r"`((?:grader|sim|tests|docs|notebooks|benchmarks|solution_pkg|\.ci|\.github)/[\w./*-]*)`")


@pytest.fixture(params=PAGES, ids=lambda page: page.name)
def page(request: pytest.FixtureRequest) -> Path:
    return request.param


def test_the_files_that_a_page_names_exist(page: Path):
    named = set(PATH.findall(page.read_text(encoding="utf-8")))
    assert [name for name in sorted(named) if not list(KIT.glob(name.rstrip("/"))) and "NN" not in name] == []


def test_the_links_of_a_page_lead_to_files(page: Path):
    links = re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_the_make_targets_that_a_page_names_exist(page: Path):
    targets = set(re.findall(r"^([a-z-]+):", (KIT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"(?:`|^ +)make ([a-z-]+)", page.read_text(encoding="utf-8"), re.MULTILINE))
    assert named <= targets


def test_the_verbs_that_a_page_names_exist(page: Path):
    verbs = set(_parser([])._subparsers._group_actions[0].choices)  # type: ignore[union-attr,arg-type]
    named = set(re.findall(r"`(?:\.venv/bin/)?grader ([a-z][a-z-]*)", page.read_text(encoding="utf-8")))
    assert named - {"is"} <= verbs
