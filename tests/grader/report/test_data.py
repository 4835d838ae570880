"""report.json: strict, safe, and just what docs/report-format.md says."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.report_examples import (
    BUILD,
    HAND_IN,
    INTAKE,
    REFUSED,
    RUBRIC,
    TOUCHED,
    grading,
    mediocre,
    results,
)

from grader import KIT
from grader.evidence import Evidence, Flag
from grader.report import data
from grader.scoring.rubric import load
from grader.scoring.scorecard import CheckResult, Outcome

FORMAT = KIT / "docs" / "report-format.md"


def paths(value, prefix=""):
    """Return the path of every field: requirements[].checks[].id."""
    if isinstance(value, dict):
        found = set()
        for key, item in value.items():
            path = f"{prefix}.{key}" if prefix else key
            inside = set() if key == "environment" else paths(item, path)
            found |= inside or {path}
        return found
    if isinstance(value, list):
        return {f"{prefix}[]"}.union(*(paths(item, f"{prefix}[]") for item in value))
    return {prefix}


@pytest.mark.parametrize(("section", "result"), [(0, mediocre(load(RUBRIC))), (1, REFUSED)], ids=["graded", "refused"])
def test_every_field_is_documented_and_every_documented_field_is_written(section, result):
    parts = re.split("## A submission that could not be graded|## What a class knows", FORMAT.read_text())
    text = parts[section] + parts[2]
    documented = set(re.findall(r"^\| `([^`]+)` \| (?:string|number|integer|boolean|object)", text, re.M))
    assert documented == paths(data.as_data(result, HAND_IN))


def test_every_outcome_and_both_schemas_are_documented():
    words = set(re.findall(r"^\| `(\w+)` \| [^|]+ \|$", FORMAT.read_text(), re.M))
    assert {outcome.value for outcome in Outcome} <= words
    assert all(f"`{schema}`" in FORMAT.read_text() for schema in (data.SCHEMA, data.REFUSAL_SCHEMA))


def test_a_refusal_says_why_and_what_to_do_and_claims_no_points():
    report = data.as_data(REFUSED)
    assert report["schema"] == "ros2-course-kit/refusal/1"
    assert report["refused"] == {"because": REFUSED.because, "try": REFUSED.try_}
    assert not {"total", "max", "criteria", "requirements"} & set(report)


def test_full_marks_of_what_is_graded_say_out_of_how_many(rubric):
    report = data.as_data(grading(rubric, results(rubric)))
    assert (report["total"], report["max"], report["worth"], report["complete"]) == (8, 8, 12, True)
    t1 = report["requirements"][2]
    assert (t1["outcome"], t1["points"], t1["max"], t1["worth"], t1["checks"]) == ("not_graded", 0, 0, 4, [])


def test_a_failed_requirement_tells_seen_expected_and_try(rubric):
    report = data.as_data(grading(rubric, results(rubric, TOUCHED)))
    f4 = report["requirements"][0]
    assert (f4["outcome"], f4["points"], f4["max"]) == ("partial", 2, 5)
    assert f4["seen"].startswith("touched the wall ahead")
    assert f4["expected"] == "no contact for the whole trial"
    assert f4["try"].startswith("which beam")
    assert [check["outcome"] for check in f4["checks"]] == ["failed", "passed"]


def test_a_requirement_shows_what_can_be_mended_before_what_waits_for_it(rubric):
    waits = CheckResult("check_obstacle::test_never_touches", Outcome.NOT_REACHED, 0, because="it never drove")
    late = CheckResult("check_obstacle::test_stops_in_time", Outcome.FAILED, 0, seen="zero came 0.9 s late")
    report = data.as_data(grading(rubric, results(rubric, waits, late)))
    assert report["requirements"][0]["seen"] == "zero came 0.9 s late"


def test_an_error_of_ours_makes_the_report_incomplete(rubric):
    report = data.as_data(grading(rubric, results(rubric)[1:]))
    assert report["complete"] is False
    assert report["requirements"][0]["outcome"] == "error"
    assert report["max"] == 5


def test_nan_and_infinity_never_get_into_the_json(rubric):
    nan = CheckResult("check_navigation::test_reaches_a_target", Outcome.FAILED, math.nan)
    text = data.as_json(grading(rubric, results(rubric, nan), wall_seconds=math.inf))

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    report = json.loads(text, parse_constant=refuse)
    assert report["wall_seconds"] is None
    assert report["requirements"][1]["checks"][0]["fraction"] == 0


def test_hostile_names_are_spelt_out_and_the_file_is_ascii(rubric):
    intake = replace(INTAKE, package="p\u202egpj.exe\x1b[2J", notes=["\x1b]0;owned\x07"])
    flags = [Flag("k\x00", "one\ntwo\x1b[31m", "\u2066file")]
    made = grading(rubric, results(rubric), Evidence(intake, BUILD, flags=flags), submission="a\nb\ud800.zip")
    text = data.as_json(made)
    assert text.isascii()
    report = json.loads(text)
    assert report["package"] == r"p\u202egpj.exe\x1b[2J"
    assert report["submission"] == r"a\nb\ud800.zip"
    assert report["notes"] == [r"\x1b]0;owned\x07"]
    (flag,) = report["integrity"]
    assert (flag["kind"], flag["what"], flag["where"]) == (r"k\x00", "one\ntwo\\x1b[31m", r"\u2066file")


def test_ten_megabytes_in_one_line_are_cut_with_a_note(rubric):
    long = replace(TOUCHED, seen="x" * 10_000_000)
    text = data.as_json(grading(rubric, results(rubric, long)))
    assert len(text) < 40_000
    assert "characters more)" in text


def test_the_file_is_written_whole_or_not_at_all(rubric, tmp_path, monkeypatch):
    path = tmp_path / "out" / "report.json"
    data.write_json(grading(rubric, results(rubric)), path)
    before = path.read_text()

    def full(self, target):
        raise OSError("no space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="no space"):
        data.write_json(grading(rubric, results(rubric), seed=8), path)
    assert path.read_text() == before
    assert [file.name for file in path.parent.iterdir()] == ["report.json"]


def test_a_figure_survives_the_report(rubric):
    measured = replace(TOUCHED, figures={"time": 41.5, "clearance": math.inf})
    report = data.as_data(grading(rubric, results(rubric, measured)))
    (again,) = [result for result in data.results(report) if result.id == TOUCHED.id]
    assert again.figures == {"time": 41.5}
