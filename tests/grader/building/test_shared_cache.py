"""The cache that an administrator makes for all users of a kit: builds read it, and none writes it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import COURSE

from grader import building, cli, pipeline
from grader.building import cache, colcon
from grader.errors import UsageError


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty shared cache."""
    folder = tmp_path / "shared_cache"
    (folder / "builds" / "abc" / "install").mkdir(parents=True)
    (folder / "builds" / "abc" / "install" / "type.so").write_text("code")
    (folder / "builds" / "abc" / "install" / "link").symlink_to("type.so")
    monkeypatch.setattr(cache, "SHARED", folder)
    return folder


def test_what_only_administrators_can_alter_is_read(shared: Path):
    assert cache.shared("builds", "abc") == shared / "builds" / "abc"
    assert cache.shared("builds", "other") is None


ALTERABLE: dict[str, Callable[[Path], object]] = {
    "": lambda shared: shared.chmod(0o777),
    "builds": lambda shared: (shared / "builds").chmod(0o775),
    "builds/abc": lambda shared: (shared / "builds/abc").chmod(0o1777),
    "builds/abc/install/type.so": lambda shared: (shared / "builds/abc/install/type.so").chmod(0o664),
}


@pytest.mark.parametrize("where", ALTERABLE)
def test_what_users_can_alter_is_not_read(
    shared: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], where: str
):
    ALTERABLE[where](shared)
    assert cache.shared("builds", "abc") is None
    assert cli.main(["cache", "--cache", str(shared.parent)]) == 0
    assert f"No build reads it, because users could alter {shared / where}." in capsys.readouterr().out


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to give a file to another user")
@pytest.mark.parametrize("where", ["", "builds", "builds/abc/install/type.so", "builds/abc/install/link"])
def test_what_belongs_to_a_user_is_not_read(shared: Path, where: str):
    os.chown(shared / where, 12345, 12345, follow_symlinks=False)
    assert cache.shared("builds", "abc") is None


@pytest.mark.slow  # a build
@pytest.mark.sandbox
def test_a_first_build_takes_the_interfaces_from_the_shared_cache_and_leaves_it_alone(
    shared: Path, settings: pipeline.Settings, tmp_path: Path
):
    own = tmp_path / "own"
    assert not building.contract_is_built(own, COURSE)
    built = building.build_contract(settings.cache, COURSE).install.parent
    here = shared / "builds" / built.name
    shutil.copytree(built, here, symlinks=True)
    for folder, names, files in os.walk(shared):
        for path in (Path(folder), *(Path(folder, name) for name in (*names, *files))):
            if not path.is_symlink():
                path.chmod(path.stat().st_mode & ~0o222)
    assert building.contract_is_built(own, COURSE)
    assert building.build_contract(own, COURSE).install == here / "install"
    assert not own.exists()


def test_who_may_not_write_to_the_kit_is_told_who_may(
    shared: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(os, "access", lambda path, mode: (path, mode) != (shared, os.W_OK))
    assert cli.main(["cache", "--share"]) == 2
    assert capsys.readouterr().err == (
        f"grader: This user may not write to {shared}. Run it as the owner of the kit.\n"
    )


def test_a_course_without_interfaces_has_nothing_to_share(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(cache, "SHARED", tmp_path / "shared_cache")
    with pytest.raises(UsageError, match="nothing to share"):
        colcon.share_contract(replace(COURSE, interfaces=()))
    assert not (tmp_path / "shared_cache").exists()


@pytest.mark.slow  # builds with colcon
@pytest.mark.sandbox
def test_an_administrator_shares_what_any_user_can_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(cache, "SHARED", tmp_path / "shared_cache")
    assert cli.main(["cache", "--share", "--cache", str(tmp_path / "own")]) == 0
    assert f"Cache: {tmp_path / 'shared_cache'}\n  builds              1" in capsys.readouterr().out
    assert building.build_contract(tmp_path / "own", COURSE).install.is_relative_to(tmp_path / "shared_cache")
    files = list((tmp_path / "shared_cache").rglob("*"))
    assert all(path.stat().st_mode & 0o044 == 0o044 for path in files)
    assert cache.alterable(tmp_path / "shared_cache") is None
