"""Two users of one hub, each with a simulated robot in a notebook: neither hears the other's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers import beside
from helpers.node_runs import run_with_node

TEXTS = beside(__file__)

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # two kernels, each with nodes


def hub(tmp_path: Path, forced: int) -> list[dict[str, Any]]:
    """Return what two users heard; `forced` is a domain for both, 0 for those that their notebooks choose."""
    for name in ("anna", "bela"):
        (tmp_path / name).mkdir()
    (tmp_path / "user.py").write_text(TEXTS["USER"])
    (tmp_path / "hub.py").write_text(TEXTS["HUB"])
    return run_with_node(tmp_path / "hub.py", tmp_path / "user.py", tmp_path, str(forced))  # type: ignore[return-value]


def test_two_users_of_a_hub_hear_only_their_own_robots(tmp_path: Path):
    anna, bela = hub(tmp_path, 0)
    assert anna["domain"] != bela["domain"]
    assert (list(anna["heard"]), list(bela["heard"])) == (["1"], ["-1"])
    assert anna["heard"]["1"] > 50


def test_in_one_domain_the_two_would_hear_each_other(tmp_path: Path):
    """What the test above is worth: the same two kernels, in one domain, hear both robots."""
    for user in hub(tmp_path, 7):
        assert set(user["heard"]) == {"1", "-1"}
