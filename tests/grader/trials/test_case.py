"""A case as data: there and back, each mistake with its line, and what its steps do."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.course import COURSE
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.errors import GraderError
from grader.trials import case as cases
from grader.trials.case import Case, Step
from grader.trials.promises import hunts
from grader.trials.stage import Stage
from sim import Simulator, load_world, sensors

GOOD = """\
node: robot_controller
steps:
- wait: 0.5
- call: {service: set_speed, speed: 0.25}
- obstacle: {name: pole, bearing: 10, distance: 1.5, radius: 0.03, speed: 0.1, towards: 180}
- readings: {kind: nan, every: 3}
- set: {max_linear_speed: 0.25}
- goal: {bearing: 90, distance: 1.0, tolerance: 0.1}
- silence: scan
- remove: pole
parameters: {safety_margin: 0.25}
heading: 90
seed: 2
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "case.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@settings(max_examples=100)
@given(made=st.one_of([making.cases for making in hunts(COURSE).makings]))
def test_every_case_that_the_course_makes_up_is_read_again_as_it_was(
    made: Case, tmp_path_factory: pytest.TempPathFactory
):
    path = tmp_path_factory.getbasetemp() / "made.yaml"
    path.write_text(f"breaks: it\nseen: once\n{made.text}", encoding="utf-8")
    read = cases.read(path, COURSE)
    assert read == made
    assert hash(read) == hash(made) == hash(Case.of(made.plain()))


def test_a_case_is_what_the_file_says(tmp_path: Path):
    read = cases.read(written(tmp_path, GOOD), COURSE)
    assert (read.node, read.heading, read.seed, read.parameters) == ("robot_controller", 90, 2, {"safety_margin": 0.25})
    assert read.steps[1] == Step("call", {"service": "set_speed", "speed": 0.25})
    assert [step.do for step in read.steps][-2:] == ["silence", "remove"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("node: robot_controller", "node: robot_control", "line 1: robot_control is not a node of the contract. Did you mean robot_controller?"),
        ("node: robot_controller\n", "", "line 1: 'node' is missing; a case needs node, steps"),
        ("steps:", "stepps:", "line 2: stepps is not allowed here. Did you mean steps?"),
        ("- wait: 0.5", "- wiat: 0.5", "line 3: wiat is not allowed here. Did you mean wait?"),
        ("- wait: 0.5", "- wait 0.5", "line 3: a mapping is expected here"),
        ("- wait: 0.5", "- {wait: 0.5, remove: pole}", "line 3: a step has one name, such as `- wait: 1.0`"),
        ("wait: 0.5", "wait: soon", "line 3: a number such as 0.5 is expected here"),
        ("wait: 0.5", "wait: 1e1", "line 3: a number such as 0.5 is expected here"),
        ("wait: 0.5", "wait: .nan", "line 3: .nan is out of range here"),
        ("wait: 0.5", "wait: -1", "line 3: -1 is out of range here"),
        ("service: set_speed", "service: set_sped", "line 4: set_sped is not a service of this node. Did you mean set_speed?"),
        ("service: set_speed, ", "", "line 4: 'service' is missing; a call needs service"),
        ("set_speed, speed: 0.25}", "set_speed, sped: 0.25}", "line 4: sped is not a field of srv/SetSpeed. Did you mean speed?"),
        ("set_speed, speed: 0.25}", "set_speed, speed: 1}", "line 4: a float is needed here: write 1.0"),
        ("set_speed, speed: 0.25}", "set_speed, speed: fast}", "line 4: a value of the type float is needed here, not fast"),
        ("radius: 0.03, ", "", "line 5: 'radius' is missing; the step obstacle needs name, bearing, distance, radius"),
        ("towards", "toward", "line 5: toward is not allowed here. Did you mean towards?"),
        ("radius: 0.03", "radius: 0", "line 5: 0 is out of range here"),
        ("- readings", "- obstacle: {name: pole, bearing: 0, distance: 1, radius: 0.1}\n- readings", "line 6: pole is the name of an obstacle above"),
        ("kind: nan", "kind: none at all", "line 6: none at all is not a kind of reading"),
        ("every: 3", "every: 0", "line 6: 0 is out of range here"),
        ("every: 3", "every: 2.5", "line 6: a whole number is expected here"),
        ("max_linear_speed: 0.25", "max_speed: 0.25", "line 7: max_speed is not a parameter of this node. Did you mean max_linear_speed?"),
        ("max_linear_speed: 0.25", "max_linear_speed: 1", "line 7: a float is needed here: write 1.0"),
        ("bearing: 90", "bearing: left", "line 8: a number such as 0.5 is expected here"),
        ("- silence: scan", "- silence: lidar", "line 9: lidar is not a sensor. There are: scan, imu, battery"),
        ("- silence: scan", "- listen: scan", "line 9: scan is not a topic of this node"),
        ("- silence: scan", "- battery: 120", "line 9: 120 is out of range here"),
        ("- remove: pole", "- remove: pol", "line 10: pol is not an obstacle of a step above. Did you mean pole?"),
        ("safety_margin: 0.25", "safety_margin: [1, 2]", "line 11: a plain text or number is expected here"),
        ("seed: 2", "seed: 2.5", "line 13: a whole number is expected here"),
        (GOOD, "", "line 1: 'node' is missing; a case needs node, steps"),
        ("- wait: 0.5", "- wait: [0.5", "Correct the YAML"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_line(tmp_path: Path, old: str, new: str, said: str):
    assert GOOD.count(old) == 1
    with pytest.raises(GraderError) as caught:
        cases.read(written(tmp_path, GOOD.replace(old, new)), COURSE)
    assert str(tmp_path / "case.yaml") in str(caught.value)
    assert said in str(caught.value)


def test_the_mistakes_of_all_steps_are_named_at_once(tmp_path: Path):
    text = GOOD.replace("wait: 0.5", "wait: soon").replace("silence: scan", "silence: lidar")
    with pytest.raises(GraderError) as caught:
        cases.read(written(tmp_path, text), COURSE)
    said = str(caught.value).splitlines()
    assert ["line 3: a number" in line or "line 9: lidar" in line for line in said] == [True, True]


def test_a_node_without_an_action_takes_no_goal(tmp_path: Path):
    steps = "- goal: {bearing: 90, distance: 1.0, tolerance: 0.1}"
    with pytest.raises(GraderError, match="line 3: sensor_processor has no action, so it takes no goals"):
        cases.read(written(tmp_path, f"node: sensor_processor\nsteps:\n{steps}\n"), COURSE)


class FakeStage:
    """Writes down what a script asks for, with a real robot and world."""

    def __init__(self) -> None:
        self.simulator = Simulator(load_world("open_field"), noise=False)
        self.did: list[Any] = []
        self.change: Any = None
        self.goals: list[SimpleNamespace] = []

    t = property(lambda self: self.simulator.time)

    def run(self, seconds: float) -> None:
        self.simulator.step(seconds)

    def run_until(self, condition: Any, limit: float) -> None:
        self.did.append(("until", condition(), limit))

    def navigate(self, x: float, y: float, tolerance: float) -> SimpleNamespace:
        self.did.append(("navigate", round(x, 6), round(y, 6), tolerance))
        goal = SimpleNamespace(running=True, ended=False, problem=None, cancel=lambda: self.did.append("cancelled"))
        self.goals.append(goal)
        return goal

    def distort(self, change: Any) -> None:
        self.change = change

    add_obstacle = Stage.add_obstacle
    remove_obstacle = Stage.remove_obstacle

    def __getattr__(self, name: str) -> Any:
        return lambda *arguments, **fields: self.did.append((name, *arguments, *fields.items()))


def do(*steps: tuple[str, Any]) -> FakeStage:
    stage: Any = FakeStage()
    Case("robot_controller", tuple(Step(name, to) for name, to in steps)).script(stage)
    found: FakeStage = stage
    return found


def test_each_step_asks_the_stage_for_what_it_says():
    stage = do(
        ("call", {"service": "set_speed", "speed": 0.25}), ("silence", "scan"), ("hear", "imu"), ("listen", "rosout"),
        ("set", {"safety_margin": 0.5, "fusion_rate": 5.0}), ("interrupt", 5.0),
    )  # fmt: skip
    assert [entry for entry in stage.did if entry[0] != "mark"] == [
        ("call", "set_speed", ("speed", 0.25)),
        ("mute", sensors.ScanReading),
        ("unmute", sensors.ImuReading),
        ("listen", "rosout"),
        ("set_parameter", "safety_margin", 0.5),
        ("set_parameter", "fusion_rate", 5.0),
        ("interrupt", 5.0),
    ]
    assert [entry[1] for entry in stage.did if entry[0] == "mark"] == [
        "0 call", "1 silence", "2 hear", "3 listen", "4 set", "5 interrupt",
    ]  # fmt: skip


def test_a_goal_lies_where_its_bearing_says_and_is_cancelled_while_it_runs():
    stage = do(("goal", {"bearing": 90, "distance": 2.0, "tolerance": 0.1}), ("arrive", 3.0), ("cancel", None))
    assert [entry for entry in stage.did if entry[0] != "mark"] == [
        ("navigate", 0.0, 2.0, 0.1), ("until", False, 3.0), "cancelled",
    ]  # fmt: skip
    assert "cancelled" not in do(("cancel", None)).did


def test_an_obstacle_has_its_surface_at_the_distance_from_the_lidar_and_moves():
    pole = {"name": "pole", "bearing": 90, "distance": 1.0, "radius": 0.2}
    stage = do(("wait", 0.5), ("obstacle", {**pole, "speed": 0.5, "towards": -90}))
    ((obstacle, place),) = stage.simulator.obstacles
    assert (obstacle.name, place) == ("pole", pytest.approx((0.0, 1.2)))
    stage.simulator.step(1.0)
    assert stage.simulator.obstacles[0][1] == pytest.approx((0.0, 0.7), abs=0.01)
    assert not do(("obstacle", pole), ("wait", 0.1), ("remove", "pole"), ("remove", "pole")).simulator.obstacles


def test_readings_are_spoilt_and_true_again():
    ranges = np.arange(1.0, 7.0)
    assert do(("readings", {"kind": "zero", "every": 3})).change(ranges).tolist() == [0, 2, 3, 0, 5, 6]
    assert all(math.isnan(each) for each in do(("readings", {"kind": "nan"})).change(ranges))
    assert do(("readings", {"kind": "none"})).change(ranges).size == 0
    assert do(("readings", {"kind": "nan"}), ("readings", {"kind": "true"})).change is None
    stage = do(("limits", {"least": 1, "most": 4}), ("readings", {"kind": "least", "every": 2}))
    assert ("set_range_limits", 1.0, 4.0) in stage.did
    assert stage.change(ranges).tolist() == [1, 2, 1, 4, 1, 6]


def test_the_battery_is_in_percent():
    assert do(("battery", 25)).simulator.battery().percentage == pytest.approx(0.25)
