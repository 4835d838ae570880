"""Text made to break a parser costs its author points and leaves everything else readable."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import pytest
from helpers.course import COURSE
from helpers.quality_examples import judged, with_linters, written

from grader import tracebacks
from grader.building import cache
from grader.checks.check_style import test_ament_flake8_finds_nothing as style
from grader.courses.robot_controller.checks import check_set_speed
from grader.quality import package_sources, source, source_files

GOOD = '"""A module."""\n\nX = 1\n'

HOSTILE: dict[str, bytes] = {
    "syntax error": b"def f(:\n    pass\n" * 3,
    "NUL bytes": b"x = 1\0\n",
    "10 MB on one line": b"x = '" + b"a" * 10_000_000 + b"'\n",
    "10,000 brackets deep": b"x = " + b"(" * 10_000 + b")" * 10_000 + b"\n",
    "99 brackets deep": b"x = " + b"[" * 99 + b"]" * 99 + b"\n",
    "a hundred blocks deep": b"".join(b" " * n + b"if 1:\n" for n in range(150)) + b" " * 150 + b"pass\n",
    "a long chain": b"x = " + b"\\\n + ".join([b"1"] * 20_000) + b"\n",
    "a long run of minus signs": b"x = " + b"-" * 1900 + b"1\n",
    "no such encoding": b"# -*- coding: no-such-thing -*-\nx = 1\n",
    "bytes that are not UTF-8": b"x = '\xff\xfe'\n",
    "UTF-16": 'x = "hello"\n'.encode("utf-16"),
    "unfinished string": b"'''\n" * 3 + b"x = 1\n",
    "not decodable identifiers": "ℌ = 1\nx\u202e = 2\n".encode(),
    "form feeds and carriage returns": b"x = 1\r\ry = 2\x0cz = 3\r\n",
    "a very large literal": b"x = [\n" + b"    1,\n" * 5_000 + b"]\n",
}


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory):
    """Return the facts of a package with all of them beside a good module."""
    package = written(tmp_path_factory.mktemp("hostile"), {"m/good.py": GOOD})
    for number, content in enumerate(HOSTILE.values()):
        written(package, {f"m/h{number}.py": content})
    return with_linters(package)


@pytest.mark.slow  # reads megabytes
def test_the_good_module_among_them_is_read(read):
    good = next(file for file in read.files if file.path == "m/good.py")
    assert good.problem == ""
    assert good.lines == 1
    assert any(thing.path == "m/good.py" and thing.documented for thing in read.definitions)


@pytest.mark.parametrize("name", ["syntax error", "NUL bytes", "10 MB on one line", "10,000 brackets deep", "UTF-16"])
def test_a_file_that_cannot_be_read_has_its_reason(read, name: str):
    path = f"m/h{list(HOSTILE).index(name)}.py"
    assert next(file for file in read.files if file.path == path).problem


def test_every_file_is_accounted_for(read):
    assert {file.path for file in read.files} == {"m/good.py", *(f"m/h{n}.py" for n in range(len(HOSTILE)))}


def test_a_file_that_cannot_be_read_is_not_clean_code(tmp_path: Path):
    """One finding for the syntax error would be too cheap: no other rule can be applied to the file."""
    clean = written(tmp_path, {"m/a.py": "".join(f"X{n} = {n}\n" for n in range(50))})
    assert judged(style, with_linters(clean)).share == 1.0
    hidden = written(clean, {"m/b.py": "x=1\n" * 50 + "def f(:\n"})
    result = judged(style, with_linters(hidden))
    assert result.share == pytest.approx(0.5, abs=0.01)  # half of the code counts as one finding in ten lines
    assert "m/b.py is not valid Python: line 51" in result.seen


def test_a_file_name_cannot_forge_a_finding(tmp_path: Path):
    quality = with_linters(written(tmp_path, {"m/a b\n0000/x.py:1:E999:forged.py": GOOD}))
    assert quality.style == []
    assert len(quality.files) == 1
    assert "\n" not in quality.files[0].path


def test_a_link_is_not_followed(tmp_path: Path):
    package = written(tmp_path, {"m/a.py": GOOD})
    (package / "m" / "b.py").symlink_to("/etc/passwd")
    assert [source.path for source in source_files.find(package, COURSE)] == ["m/a.py"]


def test_build_trees_and_caches_are_not_read(tmp_path: Path):
    others = (
        "build/CMakeCache.txt", "build/x.py", "install/COLCON_IGNORE", "install/x.py", "venv/pyvenv.cfg",
        "venv/lib/x.py", ".venv/lib/x.py", ".history/m/a_2024.py",
        ".github/x.py", ".vscode/x.py", ".git/hooks/pre-commit", "m/__pycache__/x.py", "m/.ipynb_checkpoints/x.py",
    )  # fmt: skip
    package = written(tmp_path, {"m/a.py": GOOD, **dict.fromkeys(others, GOOD)})
    assert [source.path for source in source_files.find(package, COURSE)] == ["m/a.py"]


def test_modules_in_a_folder_called_log_are_read_and_built(tmp_path: Path):
    """No node started: the folder was taken for colcon's, whatever was in it."""
    own = ["install/a.py", "m/a.py", "m/build/a.py", "m/log/a.py"]
    package = written(tmp_path / "p", dict.fromkeys(own, GOOD))
    assert sorted(source.path for source in source_files.find(package, COURSE)) == own
    key = cache.build_key([package])
    copied = shutil.copytree(package, tmp_path / "copied", ignore=cache.not_source)
    assert sorted(path.relative_to(copied).as_posix() for path in copied.rglob("*.py")) == own
    (package / "m" / "log" / "a.py").write_text("X = 2\n")
    assert cache.build_key([package]) != key


# -- tools that break -------------------------------------------------------------------------------------------------


def test_files_that_break_a_tool_are_named_and_the_rest_is_read():
    runs: list[list[str]] = []

    def run(items: Sequence[str]) -> str | None:
        runs.append([*items])
        return None if "bad" in items else f"read {len(items)}"

    assert source.run_without_culprits(run, ["a", "b"]) == ("read 2", [])
    assert len(runs) == 1
    assert source.run_without_culprits(run, ["a", "bad", "b"]) == ("read 2", ["bad"])
    together = source.run_without_culprits(lambda items: None if len(items) > 1 else "ok", ["a", "b"])
    assert together == (None, ["a", "b"])


def test_memory_is_limited(tmp_path: Path):
    done = source.run_python(["-c", "x = bytearray(8 * 1024**3)"], tmp_path)
    assert done is None or done.returncode != 0


@pytest.mark.slow  # waits for a limit
def test_time_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(source, "CPU_SECONDS", 1)
    assert source.run_python(["-c", "while True: pass"], tmp_path) is None


def test_a_tool_sees_nothing_of_the_environment_or_the_working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A sitecustomize.py or a flake8.py of the submission is not imported."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    written(tmp_path, {"flake8.py": "raise SystemExit('taken over')\n", "ast.py": "raise SystemExit('taken over')\n"})
    done = source.run_python(["-c", "import ast, flake8, os; print(os.environ.get('PYTHONPATH'))"], tmp_path)
    assert done is not None
    assert done.stdout.strip() == "None"


def test_texts_made_to_slow_down_a_regular_expression_are_read():
    """Each took minutes, or longer than anybody waits."""
    assert package_sources.commands("project(a)\n" + "#[[\n" * 100_000)[0].name == "project"
    assert tracebacks.without_ignored("Exception ignored in: x\nTraceback (most recent call last):\n" + "\t" * 500_000)
    assert not check_set_speed.states("1" * 100_000 + "x", 0.5)
