"""Q1: ament_flake8's rules, whatever the submission's settings, and points by density."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.quality_examples import Judged, judged, with_linters, written

from grader.checks.check_style import test_ament_flake8_finds_nothing as check
from grader.evidence import Quality

CLEAN = '"""A module."""\n\nfrom pathlib import Path\n\nHERE = Path()\n'
# One violation each, under the configuration that ament_flake8 ships.
VIOLATIONS = {
    "E501": "X = '" + "x" * 100 + "'\n",
    "E302": "X = 1\ndef f():\n    return X\n",
    "W291": "X = 1 \n",
    "F401": "import os\n",
    "F821": "X = undefined\n",
    "E722": "try:\n    X = 1\nexcept:\n    X = 2\n",
}
ALLOWED = {
    "a line of 99 columns": "X = '" + "x" * 93 + "'\n",
    "double quotes where single ones would need escapes": 'X = "it\'s"\n',
    "double quotes": 'X = "double"\n',
    "imports in any order": "import sys\nimport os\nX = sys, os\n",
    "double quotes round docstrings": '"""A module."""\n',
    "no docstring": "def f():\n    return 1\n",
    "a break before an operator": "X = (1\n     + 2)\n",
    "the order of google": "import math\nimport os\n\nimport numpy\nfrom rclpy import ok\nX = math, os, numpy, ok\n",
    "relative imports last": "import math\n\nfrom . import utils\nX = math, utils\n",
}


@pytest.fixture(scope="module")
def linted(tmp_path_factory: pytest.TempPathFactory) -> Quality:
    """Return what flake8 finds in all snippets; they are m/s0.py and so on."""
    folder = tmp_path_factory.mktemp("snippets")
    snippets = [*VIOLATIONS.values(), *ALLOWED.values()]
    return with_linters(written(folder, {f"m/s{number}.py": text for number, text in enumerate(snippets)}))


def rules(quality: Quality, path: str) -> set[str]:
    return {finding.rule for finding in quality.style if finding.path == path}


@pytest.mark.parametrize(("number", "rule"), list(enumerate(VIOLATIONS)), ids=str)
def test_a_violation_is_found_with_its_rule(linted: Quality, number: int, rule: str):
    assert rule in rules(linted, f"m/s{number}.py")


@pytest.mark.parametrize(("number", "name"), list(enumerate(ALLOWED, len(VIOLATIONS))), ids=str)
def test_what_ament_flake8_allows_is_allowed(linted: Quality, number: int, name: str):
    assert rules(linted, f"m/s{number}.py") == set(), name


def style(tmp_path: Path, files: dict[str, str | bytes | None]) -> tuple[Quality, Judged]:
    quality = with_linters(written(tmp_path, files))
    return quality, judged(check, quality)


def test_points_fall_with_the_density(tmp_path: Path):
    """Full marks at no finding, none at 1 per 10 lines of code, linear: 1 in 20 is half."""
    lines = [f"X{number} = {number}" for number in range(20)]
    lines[7] += " "
    _, result = style(tmp_path, {"m/a.py": "\n".join(lines) + "\n"})
    assert result.share == pytest.approx(0.5)
    assert "m/a.py:8" in result.seen
    assert "W291" in result.seen


def test_blank_lines_comments_and_long_strings_do_not_dilute_the_findings(tmp_path: Path):
    padding = "# a comment\n\n" * 200 + "'''\n" + "text\n" * 200 + "'''\n"
    quality, result = style(tmp_path, {"m/a.py": "X = 1 \n" * 5 + padding})
    assert sum(file.lines for file in quality.files) < 10
    assert result.share == 0.0


@pytest.mark.parametrize(
    "files",
    [
        {".flake8": "[flake8]\nignore = W291\nexclude = m\n"},
        {"setup.cfg": "[flake8]\nmax-line-length = 999\nextend-ignore = W,E,F\n"},
        {"tox.ini": "[flake8]\nper-file-ignores = m/*:W291\n", "ruff.toml": "ignore = ['W']\n"},
        {"m/.flake8": "[flake8]\ndisable_noqa = False\nignore = W\n"},
        {"m/a.py": "# flake8: noqa\nX = 1 \n"},
        {"m/a.py": "X = 1 # noqa: W291 \n"},
    ],
    ids=["own .flake8", "own setup.cfg", "tox.ini and ruff.toml", ".flake8 beside the file", "file noqa", "line noqa"],
)
def test_the_submissions_own_settings_do_not_count(tmp_path: Path, files: dict[str, str]):
    quality, result = style(tmp_path, {"m/a.py": "X = 1 \n", **files})
    assert rules(quality, "m/a.py") & {"W291", "E261"}
    assert result.share < 1


def test_findings_come_with_their_reasons_and_not_more_than_ten_are_shown(tmp_path: Path):
    _, result = style(tmp_path, {"m/a.py": CLEAN + "import os\n"})
    assert "imported but unused" in result.seen
    assert "m/a.py:6" in result.seen
    assert "ament_flake8" in result.try_
    _, result = style(tmp_path, {"m/a.py": "".join(f"x{n}=1\n" for n in range(50)) + "import os\n"})
    assert result.share == 0.0
    assert result.seen.count("m/a.py:") <= 10
    assert "51 findings" in result.seen or "52 findings" in result.seen
    assert "more" in result.seen


def test_a_package_without_python_gets_nothing(tmp_path: Path):
    _, result = style(tmp_path, {"README.md": "# Nothing\n"})
    assert result.share == 0.0
    assert "no Python" in result.seen
