"""Notebooks that run at the same time do not find each other's nodes."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from helpers.notebook_isolation import isolated_folder

from grader.notebook.workspace import Workspace


def test_no_two_isolated_folders_share_a_domain(tmp_path: Path):
    """Of sixty random paths some would share one: there are a hundred domains."""
    with ExitStack() as stack:
        domains = [Workspace(stack.enter_context(isolated_folder(tmp_path)) / "ws").domain_id for _ in range(60)]
    assert len(set(domains)) == 60


def test_a_closed_folder_is_deleted_and_its_domain_free(tmp_path: Path):
    for _ in range(120):  # more than there are domains
        with isolated_folder(tmp_path) as folder:
            (folder / "ws").mkdir()
    assert list(tmp_path.iterdir()) == []
