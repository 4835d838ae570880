"""How it is found out what keeps submissions apart on this machine."""

from __future__ import annotations

import subprocess

import pytest

from grader.errors import GraderError
from grader.host import namespaces


@pytest.fixture(autouse=True)
def not_tried_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(namespaces._WORK_VARIABLE, "")  # so that it is as before after the test
    monkeypatch.delenv(namespaces._WORK_VARIABLE)


def bubblewrap(monkeypatch: pytest.MonkeyPatch, ends: BaseException | subprocess.CompletedProcess[str]) -> None:
    def run(*_: object, **__: object) -> subprocess.CompletedProcess[str]:
        if isinstance(ends, BaseException):
            raise ends
        return ends

    monkeypatch.setattr(subprocess, "run", run)


def test_a_busy_machine_is_no_reason_to_confine_in_a_weaker_way(monkeypatch: pytest.MonkeyPatch):
    bubblewrap(monkeypatch, subprocess.TimeoutExpired("bwrap", 60))
    with pytest.raises(GraderError, match="did not answer for 60 s"):
        namespaces.confinement()


def test_namespaces_that_are_forbidden_are_asked_for_once(monkeypatch: pytest.MonkeyPatch):
    bubblewrap(monkeypatch, subprocess.CompletedProcess("bwrap", 1, "", "bwrap: No permissions\n"))
    assert namespaces.refusal() == "bwrap: No permissions"
    bubblewrap(monkeypatch, AssertionError("tried again"))
    assert namespaces.confinement() is not namespaces.Confinement.NAMESPACES
