"""Two workspaces of one machine never share a DDS domain."""

from __future__ import annotations

import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
from helpers import beside

from grader.errors import GraderError
from grader.host import dds_domain, namespaces
from grader.notebook import workspace as domain
from grader.notebook.workspace import Workspace, claim_domain

TEXTS = beside(__file__)


@pytest.fixture(autouse=True)
def _claims_end_with_the_test():
    before = set(domain._claims)
    yield
    for root in set(domain._claims) - before:
        domain._claims.pop(root).close()


def workspace(folder: Path, name: str) -> Workspace:
    root = folder / name / "ws"
    root.mkdir(parents=True)
    return Workspace(root)


def test_thirty_kernels_that_start_at_the_same_moment_have_thirty_domains(tmp_path: Path):
    """Of thirty home folders nine shared one when the path alone decided."""
    done = subprocess.run([sys.executable, "-c", TEXTS["THIRTY"], tmp_path], capture_output=True, text=True, check=True)
    domains = {int(number) for number in done.stdout.split()}
    assert len(domains) == 30, done
    assert domains <= set(domain.DOMAINS)


def test_a_workspace_keeps_its_domain(tmp_path: Path):
    student = workspace(tmp_path, "student")
    claimed = claim_domain(student)
    domain._claims.pop(student.root).close()  # the kernel has ended
    assert student.domain_id == claimed
    assert claim_domain(student) == claimed


def test_a_second_kernel_of_a_workspace_shares_its_domain(tmp_path: Path):
    student = workspace(tmp_path, "student")
    claimed = claim_domain(student)
    program = (
        "import sys, pathlib; from grader.notebook.workspace import Workspace, claim_domain;"
        "print(claim_domain(Workspace(pathlib.Path(sys.argv[1]))))"
    )
    second = subprocess.run([sys.executable, "-c", program, student.root], capture_output=True, text=True, check=True)
    assert int(second.stdout) == claimed


def test_a_workspace_moves_away_from_a_domain_that_another_claimed_meanwhile(tmp_path: Path):
    first, second = workspace(tmp_path, "first"), workspace(tmp_path, "second")
    (second.root / ".ros_domain").write_text(str(claim_domain(first)))
    assert claim_domain(second) != first.domain_id
    assert second.domain_id == claim_domain(second)


def test_no_domain_left_is_said_with_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    taken = claim_domain(workspace(tmp_path, "first"))
    monkeypatch.setattr(domain, "DOMAINS", range(taken, taken + 1))
    with pytest.raises(GraderError, match=r"ROS domains of this machine are in use.*Shut down"):
        claim_domain(workspace(tmp_path, "second"))


# -- trials and test runs ----------------------------------------------------------------------------------------------


@pytest.fixture(autouse=True)
def _without_namespaces(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(namespaces, "confinement", lambda: namespaces.Confinement.USERS)


def test_two_gradings_on_one_machine_share_no_domain():
    """Eighteen domains were drawn without a look at who has them: a third of the trials met a stranger's robot."""
    with ExitStack() as both:
        held = [both.enter_context(dds_domain.free()) for _ in range(20)]
        assert len(set(held)) == 20
        assert set(held[:18]) == set(dds_domain.HIGH)


def test_a_trial_is_in_no_domain_of_a_notebook(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    claimed = claim_domain(workspace(tmp_path, "student"))
    monkeypatch.setattr(dds_domain, "HIGH", range(0))
    monkeypatch.setattr(dds_domain, "LOW", range(claimed, claimed + 3))
    with dds_domain.free() as one, dds_domain.free() as other:
        assert {one, other} == {claimed + 1, claimed + 2}


def test_a_trial_takes_another_domain_than_the_one_before_unless_there_is_no_other(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(dds_domain, "LOW", range(0))
    with ExitStack() as others:
        for _ in range(17):
            others.enter_context(dds_domain.free(after=220))
        with dds_domain.free(after=220) as last:
            assert last == 220


def test_a_trial_waits_for_a_domain_and_does_not_wait_for_ever(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(dds_domain, "LOW", range(0))
    monkeypatch.setattr(dds_domain, "HIGH", range(215, 216))
    waits = iter([None, None])
    with ExitStack() as before:
        before.enter_context(dds_domain.free())
        monkeypatch.setattr(dds_domain.time, "sleep", lambda _s: next(waits, before.close()))
        with dds_domain.free() as mine:
            assert mine == 215
            monkeypatch.setattr(dds_domain, "_WAIT_S", 0.0)
            with pytest.raises(GraderError, match="All 1 ROS domains of this machine are in use"), dds_domain.free():
                pytest.fail("shared")
