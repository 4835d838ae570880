"""Errors of the host (no disk, no memory, no tool, a damaged cache): a sentence and status 3, and no points lost."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers import beside
from helpers.course import COURSE
from helpers.judging import evidence_with

from grader import KIT, building, cli, pipeline
from grader.errors import GraderError
from grader.host import ros_env, shortage
from grader.scoring.grading import Grading

TEXTS = beside(__file__)

MB = 1_000_000


def grader(*arguments: object, before: tuple[object, ...] = (), **options: object) -> subprocess.CompletedProcess[str]:
    command = [*map(str, before), sys.executable, "-m", "grader.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=600, cwd=KIT, **options)  # type: ignore[call-overload, no-any-return]


def small_disk(at: Path, size: int) -> tuple[object, ...]:
    """Return the start of a command that mounts a new disk of `size` bytes at `at` for the rest."""
    return ("bwrap", "--dev-bind", "/", "/", "--size", size, "--tmpfs", at, "--die-with-parent", "--")


def message(done: subprocess.CompletedProcess[str]) -> str:
    """Return the grader's only line on stderr that is not progress."""
    [line] = [line for line in done.stderr.splitlines() if not line.startswith("[")]
    return line


# -- words --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "A disk is full"),
        (OSError(errno.ENOSPC, "No space left on device", "/proc/x"), "The disk at /proc is full"),
        (OSError(errno.EDQUOT, "Quota"), "A disk is full"),
        (MemoryError(), "run out of memory"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "run out of memory"),
        (RuntimeError("can't start new thread"), "run out of memory"),
        (ImportError("x.so: failed to map segment from shared object"), "run out of memory"),
        (OSError(errno.EMFILE, "Too many"), "limit on open files"),
        (PermissionError(errno.EACCES, "no", "/a/b"), "may not use /a/b: Permission denied"),
        (OSError(errno.EROFS, "no", "/a/b"), "may not use /a/b: Read-only file system"),
        (NotADirectoryError(errno.ENOTDIR, "no", "/a/b"), "may not use /a/b: Not a directory"),
        (FileNotFoundError(errno.ENOENT, "no", "bwrap"), "The program bwrap is not on the PATH"),
    ],
)
def test_each_error_of_the_host_has_a_sentence_with_advice(error: Exception, words: str):
    sentence = shortage.explain(error)
    assert words in sentence
    assert "No points are lost" in sentence
    assert any(advice in sentence for advice in ("grade again", "grader doctor", "Change", "Remove it"))
    assert "\n" not in sentence


def test_an_error_of_the_code_is_not_a_shortage():
    for error in (KeyError("x"), FileNotFoundError(errno.ENOENT, "no", "/a/b"), OSError(errno.EIO, "bad", "/a")):
        assert shortage.explain(error) == ""


def test_the_cause_of_an_error_and_the_output_of_a_process_of_the_grader_are_explained():
    error = ValueError("cannot read")
    error.__cause__ = MemoryError()
    assert "run out of memory" in shortage.explain(error)
    assert "A disk is full" in shortage.explain_output("Traceback\nOSError: [Errno 28] No space left on device")
    assert "run out of memory" in shortage.explain_output("RuntimeError: can't start new thread")
    assert shortage.explain_output("AssertionError") == ""


def test_the_command_prints_the_sentence_and_exits_with_3(monkeypatch: pytest.MonkeyPatch, capsys, tmp_path: Path):
    def fails(*_: object, **__: object) -> Grading:
        raise MemoryError

    monkeypatch.setattr(pipeline, "grade", fails)
    assert cli.main(["grade", str(tmp_path), "--out", str(tmp_path / "out")]) == 3
    printed = capsys.readouterr()
    assert printed.err.startswith("grader: The grader has run out of memory.")
    assert "Traceback" not in printed.err
    assert printed.out == ""


# -- results are written whole or not at all ----------------------------------------------------------------------


@pytest.fixture
def ungraded(monkeypatch: pytest.MonkeyPatch, settings: pipeline.Settings) -> Callable[..., object]:
    """Return `pipeline.grade` without a submission: its evidence is given, and nothing is judged."""
    seen = evidence_with()
    monkeypatch.setattr(pipeline, "_collected", lambda *_, **__: seen)
    monkeypatch.setattr(pipeline, "judge", lambda *_: Grading(None, seen, {}, "x", 0, 0.0))  # type: ignore[arg-type]
    return lambda out, write: pipeline.grade(KIT / "solution_pkg", out, settings, write)


def contents(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.slow  # a grading
@pytest.mark.sandbox
def test_a_report_that_cannot_be_written_leaves_the_previous_results_and_the_next_replaces_them(
    ungraded, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    ungraded(tmp_path, lambda _, folder: (folder / "report.json").write_text("first"))
    before = contents(tmp_path)
    assert before["report.json"] == "first"
    assert "evidence/build.json" in before

    def fills_the_disk(_: object, folder: Path) -> None:
        (folder / "report.json").write_text("second")
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(shortage, "MIN_FREE_BYTES", 10**18)
        with pytest.raises(GraderError, match=r"^The disk at /.* is full\. No points are lost"):
            ungraded(tmp_path, fills_the_disk)
    assert contents(tmp_path) == before
    ungraded(tmp_path, lambda _, folder: (folder / "report.json").write_text("third"))
    assert (tmp_path / "report.json").read_text() == "third"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["evidence", "report.json"]


# -- disk ---------------------------------------------------------------------------------------------------------


@pytest.mark.sandbox
@pytest.mark.parametrize(("size", "words"), [(40 * MB, "grader: The disk at"), (400 * MB, "exit_code=0")])
def test_a_disk_that_fills_up_is_not_blamed_on_the_submission(tmp_path: Path, size: int, words: str):
    """Otherwise a build that meets "No space left on device" would count as a package that does not build."""
    command = [*map(str, small_disk(tmp_path, size)), sys.executable, "-c", TEXTS["FILLS_DISK"], str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=KIT)
    assert done.stdout.startswith(("grader", "RunResult"))
    assert words in done.stdout


@pytest.mark.slow  # gradings on a full disk
@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.parametrize("full", ["cache", "out", "tmp"])
def test_a_full_disk_costs_no_points_and_the_next_grading_is_right(reference: Path, tmp_path: Path, full: str):
    small, cache, scratch, out = (tmp_path / name for name in ("rubric.yaml", "cache", "tmp", "out"))
    small.write_text(TEXTS["RUBRIC"])
    for folder in (cache, scratch, out):
        folder.mkdir()
    package = shutil.copytree(reference, tmp_path / reference.name)
    (package / "NOTES.md").write_text(f"Not the package that is built already: {tmp_path}\n")
    run = ("grade", package, "--rubric", small, "--out", out)
    where = {"out": out, "tmp": scratch, "cache": cache}[full]
    # The disk has enough space for its present content, and too little for the rest.
    built = building.build_contract(building.cache_folder(), COURSE).install.parent
    keep = f"mkdir {cache}/builds; cp -a {built} {cache}/builds; " if full == "cache" else ""
    room, size = (10 * MB, 100 * MB) if full == "cache" else (20_000, MB)
    ballast = f"head -c $(($(stat -f -c '%a * %S' {where}) - {room})) /dev/zero >{where}/ballast; "
    script = f'{keep}{ballast}exec "$@"'
    environment = {**os.environ, "TMPDIR": str(scratch), "PYTHONDONTWRITEBYTECODE": "1"}
    chosen = ("--cache", cache) if full == "cache" else ()
    before = (*small_disk(where, size), "sh", "-c", script, "sh")
    done = grader(*run, *chosen, before=before, env=environment)
    assert done.returncode == 3, done.stderr
    assert f"The disk at {where} is full" in message(done) or "No space left on device. Free some" in message(done)
    assert list(out.iterdir()) == []
    again = grader(*run)
    assert again.returncode == 0, again.stderr
    assert json.loads((out / "report.json").read_text())["total"] == 1


# -- memory -------------------------------------------------------------------------------------------------------


@pytest.mark.slow  # starts the grader for each limit
@pytest.mark.sandbox
@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ("300000000:", "may use only 300 MB of address space and needs 1000. Run `ulimit -v unlimited`"),
        # Below the limit that a sandbox sets, and unchangeable: every command in a sandbox would fail.
        ("2000000000:2000000000", "failed to set the AS resource limit: Operation not permitted. Run `grader doctor`"),
    ],
)
def test_a_limit_on_the_graders_memory_is_reported_before_anything_is_graded(tmp_path: Path, limit: str, words: str):
    before = ("prlimit", f"--as={limit}")
    done = grader("grade", KIT / "solution_pkg", "--out", tmp_path / "out", before=before)
    assert done.returncode == 3
    assert words in message(done)
    assert not (tmp_path / "out").exists()


# -- tools --------------------------------------------------------------------------------------------------------


def test_a_missing_tool_is_named(tmp_path: Path):
    for name in ("cc", "c++", "colcon", "ninja"):
        (tmp_path / name).symlink_to("/bin/true")
    assert ros_env.missing_tools(str(tmp_path)) == ["cmake"]
    (tmp_path / "c++").unlink()
    assert ros_env.missing_tools(str(tmp_path)) == ["C++ compiler", "cmake"]


@pytest.mark.slow  # a grading
@pytest.mark.sandbox
def test_without_a_compiler_nothing_is_built_or_cached(reference: Path, tmp_path: Path):
    hidden = [path for name in ("c++", "g++", "clang++") if (path := shutil.which(name))]
    hide = [word for path in hidden for word in ("--ro-bind", "/dev/null", os.path.realpath(path))]
    before = ("bwrap", "--dev-bind", "/", "/", *hide, "--")
    done = grader("check", "I1", "--package", reference, "--cache", tmp_path / "cache", before=before)
    assert done.returncode == 3
    assert "This machine has no C++ compiler, so no package can be built. Run `grader doctor`" in message(done)
    assert list((tmp_path / "cache" / "builds").glob("*/build.json")) == []
