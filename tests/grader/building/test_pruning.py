"""Pruning the cache: what has long not been used goes, what a grading uses or builds stays."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from grader import cli
from grader.building import cache

DAY_S = 86400


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A cache with a build and a build tree used 40 days ago and others used today."""
    for name, days in (("a" * 40, 40), ("b" * 40, 0)):
        for store in ("builds", "trees"):
            (tmp_path / store / name / "install").mkdir(parents=True)
            (tmp_path / store / name / "install" / "node.py").write_text("x" * 10_000)
            for path in (tmp_path / store / f"{name}.use", tmp_path / store / name):
                path.touch()
                os.utime(path, (time.time() - days * DAY_S,) * 2)
        (tmp_path / "builds" / f"{name}.lock").touch()
    (tmp_path / "ccache" / "0").mkdir(parents=True)
    return tmp_path


def names(folder: Path) -> list[str]:
    return sorted(path.name[0] + path.suffix for path in (folder / "builds").iterdir())


def pruned(folder: Path, days: float) -> tuple[dict[str, int], int]:
    """Return how many entries were removed, by store, and how many are in use."""
    removed, in_use = cache.prune(folder, days)
    return {title: len(entries) for title, entries in removed.items() if entries}, in_use


def test_what_has_long_not_been_used_is_removed_with_its_locks(folder: Path):
    assert pruned(folder, 30) == ({"builds": 1, "build trees": 1}, 0)
    assert names(folder) == ["b", "b.lock", "b.use"]


def test_a_use_counts_from_its_last_time(folder: Path):
    del_later = cache.Use(folder / "builds" / ("a" * 40))
    del del_later
    assert pruned(folder, 30) == ({"build trees": 1}, 0)


def test_what_a_grading_uses_stays(folder: Path):
    use = cache.Use(folder / "builds" / ("a" * 40))
    assert pruned(folder, 0) == ({"builds": 1, "build trees": 2}, 1)
    assert (folder / "builds" / ("a" * 40) / "install").is_dir()
    del use
    assert pruned(folder, 0) == ({"builds": 1, "compiler cache": 1}, 0)
    assert names(folder) == []


def test_what_is_being_built_stays_and_what_a_killed_build_left_goes(folder: Path):
    for name in ("a", "c"):
        (folder / "builds" / f"{name * 40}.xyz.work").mkdir()
    with cache.locked(folder / "builds" / f"{'c' * 40}.lock"):
        cache.remove_abandoned(folder)
        assert [path.name[0] for path in (folder / "builds").glob("*.work")] == ["c"]
        assert pruned(folder, 0)[1] == 1
    cache.prune(folder, 0)
    assert names(folder) == []


def test_a_lock_whose_file_was_removed_meanwhile_is_taken_on_the_new_one(folder: Path):
    path = folder / "builds" / f"{'a' * 40}.lock"
    with cache.locked(path):
        path.unlink()
        with cache.locked(path, wait=False), pytest.raises(BlockingIOError), cache.locked(path, wait=False):
            pass


def test_the_command_shows_and_prunes(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["cache", "--cache", str(folder)]) == 0
    shown = capsys.readouterr().out
    assert f"Cache: {folder}" in shown
    today, then = (time.strftime("%Y-%m-%d", time.localtime(time.time() - days * DAY_S)) for days in (0, 40))
    assert f"builds              2       0.0 MB  last used {then} to {today}" in shown
    assert cli.main(["cache", "--prune", "--older-than", "7", "--cache", str(folder)]) == 0
    assert capsys.readouterr().out.startswith("Removed: 1 builds (0.0 MB), 1 build trees (0.0 MB)\n")
    assert cli.main(["cache", "--prune", "--cache", str(folder)]) == 0
    assert capsys.readouterr().out.startswith("Removed: nothing\n")


def test_a_number_of_days_without_prune_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["cache", "--older-than", "7", "--cache", str(folder)]) == 2
    assert "Add --prune" in capsys.readouterr().err
