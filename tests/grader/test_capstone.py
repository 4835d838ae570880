"""The capstone, patrol and dock: its checks on made evidence, its kit, and a class of four that is graded by it.

The solution is in tests/courses/patrol_and_dock; the weaker hand-ins are known-bad edits of it.
"""

from __future__ import annotations

import itertools
import json
import math
import re
import shutil
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.judging import Judged, ask, evidence_with

from grader import KIT, cli
from grader.authoring import check_course, notebook_run, notebook_source
from grader.classroom import gradebook, overview
from grader.classroom.class_folder import ClassFolder
from grader.course import handout, kits_own, load
from grader.course.reader import VARIABLE, modules
from grader.evidence import Sample, Touch, Trial
from grader.intake import package_edits
from grader.trials import catalog
from sim import World, load_world

FOLDER = KIT / "grader" / "courses" / "patrol_and_dock"
COURSE = load(FOLDER)
WHOLE = check_course.read_rubric(COURSE)
WORTH = check_course.worth(WHOLE)
WARD = load_world(COURSE.world("ward"))
PLACES = [(place.x, place.y) for place in WARD.goals]
HOME = (WARD.start.x, WARD.start.y)
STORES = load_world(COURSE.world("stores"))
CHECKS = {
    name: check
    for folder in (COURSE.folder, COURSE.held_back)
    for module in modules(folder / "checks")
    for name, check in vars(module).items()
}
WEAKER = {"waits_before_a_bed": 72.5, "forgets_its_battery": 70.0, "takes_its_time": 95.0}


# -- the course --------------------------------------------------------------------------------------------------------


def test_its_files_have_no_mistake():
    assert check_course.mistakes(FOLDER) == []
    assert sum(criterion.points for criterion in WHOLE.criteria) == 100


def test_each_check_is_failed_by_some_edit():
    lost = {name for edit in check_course.edits(COURSE) for name in check_course.known_bad(edit, COURSE, WORTH).loses}
    assert lost == {requirement.id for requirement in WHOLE.requirements}


def test_its_handout_holds_no_solution_and_takes_two_pages():
    page = handout.render(WHOLE, COURSE)
    assert all(f"**{requirement.id}**" in page for requirement in WHOLE.requirements)
    assert len(page.split()) < 1000
    assert "chart" not in page


def test_its_kit_has_neither_solution_nor_edits_nor_the_other_building(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv(VARIABLE, "")  # set by the verb, and put back here
    assert cli.main(["release", "--course", str(FOLDER), "--out", str(tmp_path / "kit.zip")]) == 0
    with zipfile.ZipFile(tmp_path / "kit.zip") as kit:
        names = [name.partition("/")[2] for name in kit.namelist()]
        texts = b"".join(kit.read(name) for name in kit.namelist())
    assert "patrol_and_dock/notebooks/01_patrol.ipynb" in names
    assert "docs/handout.md" in names
    kept = r"grader/courses/|known_bad/|held_back/|notebooks/source|chart\.py"
    assert not [name for name in names if re.search(kept, name)]
    for told in (b"class Chart", b"NARROW_COST", b"round_of_the_stores", b"shelf of paint", b"check_elsewhere"):
        assert told not in texts


@pytest.mark.parametrize("seed", [0, 1])
def test_the_places_that_a_node_gets_are_those_of_its_world(seed: int):
    world = WARD.transformed(rotate=seed, mirror=bool(seed), shift=(1.0, 2.0))
    plan = catalog.trials(COURSE)["low_battery"].placed_in(world)
    places = plan.parameters["places"]
    assert isinstance(places, list)
    assert places == pytest.approx([value for place in world.goals for value in (place.x, place.y)], abs=1e-3)
    assert plan.parameters["battery_low"] == 30.0


# -- the checks --------------------------------------------------------------------------------------------------------


def drive(corners: Sequence[tuple[float, float]], speed: float = 0.4, **more: Any) -> list[Sample]:
    """Return the samples of a robot that drives from corner to corner, and stands at the last with the dock's yaw."""
    samples: list[Sample] = []
    for (x, y), (u, v) in itertools.pairwise(corners):
        steps = max(1, round(math.dist((x, y), (u, v)) / speed / 0.05))
        for step in range(steps):
            part = (step + 1) / steps
            samples.append(_sample(len(samples), x + part * (u - x), y + part * (v - y), v=speed))
    last = samples[-1]
    return [*samples, replace(last, t=last.t + 0.05, v=0.0, **more)]


def _sample(count: int, x: float, y: float, v: float) -> Sample:
    return Sample(0.05 * (count + 1), x, y, WARD.start.yaw, v, 0.0, x, y, 0.0, 0.3)


def patrol(name: str, corners: Sequence[tuple[float, float]], speed: float = 0.4, **more: Any) -> Trial:
    end = {key: more.pop(key) for key in ("x", "y", "yaw", "clearance", "omega") if key in more}
    facts: dict[str, Any] = {"choices": {"closed": 2.0, "visits": 2.0}, "marks": {"closed": 20.0, "low": 20.0}} | more
    return Trial(
        name, "patrol", "ward", 0, True, "lockstep", None, samples=drive(corners, speed, **end),
        scene=World.to_dict(STORES if name == "round_of_the_stores" else WARD), **facts,
    )  # fmt: skip


ROUND = [HOME, *PLACES, PLACES[0]]
DETOUR = [HOME, *PLACES[:2], PLACES[0], PLACES[4], *PLACES[2:][::-1], *PLACES[2:]]
BACK = [HOME, *PLACES[:2], PLACES[0], HOME]
ELSEWHERE = [(STORES.start.x, STORES.start.y), *((place.x, place.y) for place in STORES.goals)]


def judged(check: str, **trials: Trial) -> Judged:
    made = {
        "first_round": patrol("first_round", ROUND), "closed_corridor": patrol("closed_corridor", DETOUR),
        "low_battery": patrol("low_battery", BACK),
        "round_of_the_stores": patrol("round_of_the_stores", ELSEWHERE),
    }  # fmt: skip
    return ask(CHECKS[check], evidence_with(trials=made | trials), COURSE)


@pytest.mark.parametrize("check", [check.id.partition("::")[2] for check in WHOLE.checks])
def test_a_patrol_that_does_all_passes(check: str):
    assert judged(check).share == 1.0


@pytest.mark.parametrize("check", [check.id.partition("::")[2] for check in WHOLE.checks])
def test_a_robot_that_never_sets_out_gets_nothing(check: str):
    still = [HOME, (HOME[0] + 0.01, HOME[1])]
    named = {name: patrol(name, still, marks={}) for name, plan in catalog.trials(COURSE).items() if not plan.kind}
    assert judged(check, **named).share == 0.0


def test_only_the_next_place_of_the_list_counts():
    found = judged("test_visits_every_place", first_round=patrol("first_round", [HOME, *PLACES[::-1]]))
    assert found.share == pytest.approx(0.2)
    assert found.seen.startswith("visited 1 of 5 places")


def test_half_of_the_places_of_the_other_building_are_half_of_the_points():
    half = patrol("round_of_the_stores", ELSEWHERE[:3])
    assert judged("test_visits_every_place_of_the_stores", round_of_the_stores=half).share == 0.5


def test_places_before_the_closed_corridor_do_not_count_for_it():
    way = [HOME, *PLACES[:2]]
    found = judged("test_visits_the_places_behind_a_closed_corridor", closed_corridor=patrol("closed_corridor", way))
    assert (found.share, found.reached) == (0.0, True)


@pytest.mark.parametrize(
    ("check", "end", "seen"),
    [
        ("test_stands_at_the_dock", {"x": HOME[0] + 0.2}, "stood 0.20 m from the dock"),
        ("test_stands_at_the_dock", {"omega": 0.5}, "still moved"),
        ("test_faces_as_the_dock_does", {"yaw": WARD.start.yaw + math.radians(12)}, "stood 12 degrees off"),
        ("test_faces_as_the_dock_does", {"yaw": WARD.start.yaw + math.radians(8)}, ""),
        ("test_faces_as_the_dock_does", {"yaw": WARD.start.yaw + math.tau}, ""),
        ("test_comes_back", {"x": HOME[0] + 0.6}, "0.60 m from the dock in the end"),
        ("test_keeps_its_distance", {"clearance": 0.04}, "0.04 m at"),
    ],
)
def test_the_end_of_a_low_battery(check: str, end: dict[str, float], seen: str):
    found = judged(check, low_battery=patrol("low_battery", BACK, **end))
    assert (found.share == 1.0) == (not seen)
    assert seen in found.seen


def test_who_did_not_come_back_is_not_asked_how_it_stands():
    found = judged("test_stands_at_the_dock", low_battery=patrol("low_battery", [HOME, *PLACES[:2]]))
    assert not found.reached


def test_a_contact_in_any_trial_is_named():
    touched = patrol("closed_corridor", DETOUR, touches=[Touch(21.3, "bed in the east", 0.4)])
    found = judged("test_touches_nothing", closed_corridor=touched)
    assert (found.share, found.seen) == (0.0, "touched bed in the east at 21.3 s, at 0.40 m/s")


def test_a_slow_round_costs_its_own_points():
    slow = patrol("first_round", ROUND, speed=0.2)
    assert judged("test_is_quick", first_round=slow).share == 0.0
    assert judged("test_visits_every_place", first_round=slow).share == 1.0


# -- graded ------------------------------------------------------------------------------------------------------------


def extended(folder: Path) -> Path:
    """Return a copy of the package of the eleven notebooks with the solution's node as one more."""
    package = package_edits.copy(kits_own().solution, folder)
    for path in ("ros2_robot_controller/chart.py", "ros2_robot_controller/patrol.py", "scripts/patrol"):
        shutil.copy(COURSE.solution / path, package / path)
    install = "install(PROGRAMS scripts/robot_controller"
    package_edits.replace("CMakeLists.txt", install, install.replace("scripts/", "scripts/patrol scripts/"))(package)
    return package


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # builds the node and starts it four times
def test_its_notebook_passes_its_checks_with_the_solution(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv(VARIABLE, str(FOLDER))
    package_edits.copy(COURSE.solution, tmp_path / "ws" / "src")
    run = notebook_run.execute(notebook_source.read("01_patrol", WHOLE, COURSE.notebooks), tmp_path / "ws")
    assert run.error is None
    assert notebook_run.answered_otherwise(run.notebook) == []


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # four gradings
def test_a_class_of_four_is_ranked(tmp_path: Path):
    extended(tmp_path / "in" / "solution")
    for name in WEAKER:
        edit = check_course.known_bad(FOLDER / "known_bad" / f"{name}.yaml", COURSE, WORTH)
        edit.edit.made(COURSE.solution, tmp_path / "in" / name)
    folder = ClassFolder(tmp_path / "class")
    assert cli.main(["batch", str(tmp_path / "in"), "--out", str(folder.path), "--course", str(FOLDER)]) == 0
    league = overview.league(
        gradebook.read(folder), {name: folder.report(name) for name in (e.id for e in folder.facts().entries)}
    )
    points = {row.submission: float(row.total or 0) for _, row, _ in league}
    assert points == {"solution": 100.0} | {name.replace("_", "-"): left for name, left in WEAKER.items()}
    assert [rank for rank, *_ in league] == [1, 2, 3, 4]
    time, clearance, distance = (figure or 0.0 for figure in league[0][2])
    assert 30.0 < time < 60.0
    assert clearance >= 0.1
    assert 13.0 < distance < 18.0
    assert json.loads((folder.path / "submissions" / "solution" / "report.json").read_text())["complete"]
