"""The cache of builds: damaged entries."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers import course as spec
from helpers.course import COURSE

from grader import building, evidence, pipeline
from grader.building import cache
from grader.host import ros_env


@pytest.fixture
def entry(tmp_path: Path) -> Path:
    """A build in the cache."""
    folder = tmp_path / "builds" / "abc"
    (folder / "install" / "lib").mkdir(parents=True)
    (folder / "install" / "lib" / "node").write_text("#!/bin/sh\n")
    (folder / "install" / "link").symlink_to("lib/node")
    (folder / "build.json").write_text(evidence.to_json(evidence.Build(True, False, 1.0, 0, False, "")))
    cache.write_checksum(folder / "install")
    return folder


def test_an_intact_entry_is_used(entry: Path):
    assert cache.load(entry) is not None
    (entry / "install" / "__pycache__").mkdir()
    (entry / "install" / "__pycache__" / "x.pyc").write_bytes(b"a cache of Python")
    assert cache.load(entry) is not None


DAMAGES: dict[str, Callable[[Path], object]] = {
    "facts cut short": lambda e: (e / "build.json").write_text("{"),
    "facts of another kind": lambda e: (e / "build.json").write_text("[1]"),
    "no facts": lambda e: (e / "build.json").unlink(),
    "facts that are not text": lambda e: (e / "build.json").write_bytes(b"\xff\xfe"),
    "a folder for the facts": lambda e: ((e / "build.json").unlink(), (e / "build.json").mkdir()),
    "a file cut short": lambda e: (e / "install" / "lib" / "node").write_text(""),
    "a file changed": lambda e: (e / "install" / "lib" / "node").write_text("#!/bin/no\n"),
    "a file gone": lambda e: (e / "install" / "lib" / "node").unlink(),
    "a file more": lambda e: (e / "install" / "more").write_text(""),
    "a file that cannot be run": lambda e: (e / "install" / "lib" / "node").chmod(0o755),
    "a link turned": lambda e: ((e / "install" / "link").unlink(), (e / "install" / "link").symlink_to("lib")),
    "no checksum": lambda e: (e / "install.sha256").unlink(),
    "no install tree": lambda e: shutil.rmtree(e / "install"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_entry_is_not_used(entry: Path, damage: str):
    DAMAGES[damage](entry)
    assert cache.load(entry) is None


@pytest.mark.slow  # builds with colcon twice
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_damaged_cache_is_built_again(reference: Path, tmp_path: Path, settings: pipeline.Settings):
    """Truncate the modules of a build in the cache: the next grading builds the package again."""
    package = shutil.copytree(reference, tmp_path / reference.name)
    (package / "NOTES.md").write_text(f"Not the package that is built already: {tmp_path}\n")
    first = building.build([package], settings.cache, COURSE)
    for path in (first.install / ros_env.SITE_IN_PREFIX / spec.PACKAGE).glob("*.py"):
        path.write_text("")
    second = building.build([package], settings.cache, COURSE)
    assert not second.facts.cached
    assert second.facts.ok
    assert all(path.read_text() for path in second.install.rglob("robot_controller.py"))


def test_what_a_killed_build_left_goes_and_what_is_being_built_stays(tmp_path: Path):
    for name in ("a", "c"):
        (tmp_path / "builds" / f"{name * 40}.xyz.work").mkdir(parents=True)
    with cache.locked(tmp_path / "builds" / f"{'c' * 40}.lock"):
        cache.remove_abandoned(tmp_path)
        assert [path.name[0] for path in (tmp_path / "builds").glob("*.work")] == ["c"]
    cache.remove_abandoned(tmp_path)
    assert not list((tmp_path / "builds").glob("*.work"))
