"""Evidence kept by content: found again only where everything that decides it is the same."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from grader.evidence import Flag
from grader.processes.kept import Kept, forget_old

FLAG = Flag("kind", "what \udcff", "where")


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    found = Kept(tmp_path / "evidence", ("kit", "seed 0"))
    found.keep(FLAG, "trial", "a")
    return found


def test_a_fact_is_found_again_with_its_time(kept: Kept):
    fact, when = kept.find(Flag, "trial", "a") or (None, "")
    assert fact == FLAG
    assert when.startswith(time.strftime("%Y-"))


@pytest.mark.parametrize("decided_by", [("trial", "b"), ("trial",), ("triala",), ("tri", "al", "a")])
def test_nothing_else_is_found(kept: Kept, decided_by: tuple[str, ...]):
    assert kept.find(Flag, *decided_by) is None
    assert kept.find(list[Flag], "trial", "a") is None


def test_another_kit_or_seed_finds_nothing(kept: Kept):
    assert Kept(kept.folder, ("kit", "seed 1")).find(Flag, "trial", "a") is None
    assert Kept(kept.folder, ("other", "seed 0")).find(Flag, "trial", "a") is None
    assert Kept(kept.folder, ("kit", "seed 0")).find(Flag, "trial", "a") is not None


def test_fresh_finds_nothing_and_keeps(kept: Kept):
    fresh = Kept(kept.folder, kept.common, fresh=True)
    assert fresh.find(Flag, "trial", "a") is None
    fresh.keep(Flag("new", "one"), "trial", "a")
    assert (kept.find(Flag, "trial", "a") or [None])[0] == Flag("new", "one")


@pytest.mark.parametrize("damage", [b"", b"{}", b"\x1f\x8b\x08 torn"])
def test_a_damaged_file_is_no_evidence(kept: Kept, damage: bytes):
    assert kept.folder is not None
    (path,) = kept.folder.iterdir()
    path.write_bytes(damage)
    assert kept.find(Flag, "trial", "a") is None


def test_a_folder_that_cannot_be_written_keeps_nothing(tmp_path: Path):
    (tmp_path / "file").touch()
    kept = Kept(tmp_path / "file" / "evidence")
    kept.keep(FLAG, "trial")
    assert kept.find(Flag, "trial") is None


def test_what_is_old_is_forgotten(kept: Kept):
    assert kept.folder is not None
    kept.keep(FLAG, "trial", "old")
    os.utime(kept._path(("trial", "old")), (0, 0))
    forget_old(kept.folder)
    assert kept.find(Flag, "trial", "a")
    assert not kept.find(Flag, "trial", "old")
