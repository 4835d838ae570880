"""Notebooks that run at the same time do not find each other's nodes."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from helpers.notebook_rooms import room

from grader.notebook.workspace import Workspace


def test_no_two_rooms_share_a_domain(tmp_path: Path):
    """Of sixty paths by chance, some certainly would: there are a hundred domains."""
    with ExitStack() as rooms:
        domains = [Workspace(rooms.enter_context(room(tmp_path)) / "ws").domain_id for _ in range(60)]
    assert len(set(domains)) == 60


def test_a_room_is_gone_in_the_end_and_its_domain_free(tmp_path: Path):
    for _ in range(120):  # more than there are domains
        with room(tmp_path) as folder:
            (folder / "ws").mkdir()
    assert list(tmp_path.iterdir()) == []
