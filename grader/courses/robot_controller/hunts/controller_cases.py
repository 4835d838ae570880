"""Cases for the controller: speeds, goals, obstacles, bad readings, limits that change, all within the contract."""

from __future__ import annotations

import itertools
import math
from typing import Any

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from grader.trials.case import Case, Step
from grader.trials.promises import makes

NODE = "robot_controller"
Steps = SearchStrategy[list[Step]]
_speed = st.sampled_from([0.25, 0.5, 0.375, 0.125, -0.25, -0.5, -0.375, 0.4375, 0.0625, -0.125])
_wait = st.integers(2, 20).map(lambda n: Step("wait", n / 10))


def _then_wait(step: SearchStrategy[Step]) -> Steps:
    return st.tuples(step, _wait).map(list)


def _set_speed(speed: SearchStrategy[float]) -> SearchStrategy[Step]:
    return speed.map(lambda value: Step("call", {"service": "set_speed", "speed": value}))


def _goal(bearing: int, distance: float, tolerance: float = 0.1) -> Step:
    return Step("goal", {"bearing": bearing, "distance": distance, "tolerance": tolerance})


_ASK = Step("call", {"service": "get_status"})
_refused = _set_speed(st.sampled_from([0.75, -0.75, 0.5625, math.nan, math.inf, -math.inf, 100.0]))


_radius = st.sampled_from([0.15, 0.03, 0.012, 0.3])


@st.composite
def _obstacle(draw: Any, bearings: SearchStrategy[int], distances: SearchStrategy[int], moves: bool = True) -> Step:
    """An obstacle: where, in degrees and in steps of 2 cm; sometimes it moves."""
    to = {"name": "pole", "bearing": draw(bearings), "distance": draw(distances) / 50, "radius": draw(_radius)}
    if moves and draw(st.integers(0, 4)) == 4:
        to |= {"speed": draw(st.sampled_from([0.1, 0.2, 0.3])), "towards": draw(st.integers(-180, 180))}
    return Step("obstacle", to)


_around = st.one_of(st.integers(-60, 60), st.integers(-180, 180))
_near, _far = st.integers(10, 26), st.integers(10, 75)  # the hull goes to 0.171 m
_anywhere = st.one_of(_obstacle(_around, _far), _obstacle(_around, _near))
_at_the_edge = _obstacle(st.one_of(st.integers(46, 59), st.integers(-59, -46)), st.integers(15, 24), moves=False)
_in_the_way = _obstacle(st.integers(-30, 30), st.integers(13, 40), moves=False)
_beside = _obstacle(st.one_of(st.integers(80, 180), st.integers(-180, -80)), st.just(9), moves=False)
_wall = Step("obstacle", {"name": "wall", "bearing": 0, "distance": 2.5, "radius": 6.0})
_readings = st.tuples(
    st.sampled_from(["nan", "inf", "zero", "too near", "too far", "none", "least"]), st.sampled_from([1, 2, 5, 7])
).map(lambda each: Step("readings", {"kind": each[0], **({"every": each[1]} if each[1] > 1 else {})}))
_true = st.just(Step("readings", {"kind": "true"}))
_limits = st.sampled_from(
    [
        {"max_linear_speed": 0.375}, {"linear_acceleration": 0.5}, {"obstacle_detection_threshold": 0.75},
        {"max_linear_speed": -1.0}, {"laser_processing_rate": 0.0}, {"obstacle_detection_threshold": -1.0},
    ]
).map(lambda to: Step("set", dict(to)))  # fmt: skip


def named(steps: list[Step]) -> tuple[Step, ...]:
    """Return the steps, each obstacle with a name of its own, of which `remove` means the last, and waits joined."""
    numbers, found, last = itertools.count(1), list[Step](), ""
    for step in steps:
        if step.do == "obstacle":
            last = f"{step.to['name']} {next(numbers)}"
            found.append(Step("obstacle", {**step.to, "name": last}))
        elif step.do == "remove":
            found += [Step("remove", last)] if last else []
            last = ""
        elif step.do == "wait" and found and found[-1].do == "wait":
            found[-1] = Step("wait", round(found[-1].to + step.to, 3))
        else:
            found.append(step)
    return tuple(found)


@st.composite
def _case(draw: Any, first: Steps, later: Steps, last: Steps | None = None, *, least: int = 0, most: int = 5) -> Case:
    steps = list(draw(first))
    if steps[0].do != "silence":  # which is to begin before the first scan
        steps.insert(0, Step("wait", 0.3))
    for more in draw(st.lists(later, min_size=least, max_size=most)):
        steps += more
    steps += draw(last) if last is not None else [Step("wait", 1.0)]
    heading, seed = draw(st.sampled_from([0, 90, 180, -90, 45])), draw(st.integers(0, 3))
    return Case(NODE, named(steps), heading=heading, seed=seed)


_SPEED, _REMOVE = _then_wait(_set_speed(_speed)), _then_wait(st.just(Step("remove", "")))
_OBSTACLE = _then_wait(_anywhere)
_PASSING = st.tuples(st.one_of(_anywhere, _beside, _in_the_way), st.integers(5, 15)).map(
    lambda each: [each[0], Step("wait", each[1] / 10), Step("remove", ""), Step("wait", 1.7)]
)
"""Something that comes, stays for a while and goes."""
_AFTER_SPEED = _SPEED.map(lambda steps: [steps[0], Step("wait", 0.8)])


@makes("F1", "F2", "F3", "F5", "F11")
def _drives() -> SearchStrategy[Case]:
    """Speeds that are set, changed and refused, obstacles that come, move and go, limits that are changed."""
    blind = st.just([Step("silence", "scan"), Step("wait", 1.6), Step("hear", "scan")])
    later = st.one_of(_PASSING, _PASSING, _OBSTACLE, _SPEED, _then_wait(_refused), _then_wait(_limits))
    first = st.one_of(_SPEED, _SPEED, _SPEED, st.just([Step("wait", 1.6)]), blind)
    return _case(first, later, least=1)


@makes("F2")
def _changes_its_speed() -> SearchStrategy[Case]:
    """One speed after another, zero among them, and nothing in the way."""
    return _case(_AFTER_SPEED, _then_wait(_set_speed(st.one_of(st.just(0.0), _speed))), most=3)


@makes("F5")
def _drives_past() -> SearchStrategy[Case]:
    """A robot that drives, and something that is not in its way, or no longer."""
    aside = _obstacle(st.one_of(st.integers(66, 180), st.integers(-180, -66)), st.integers(12, 23), moves=False)
    return _case(_AFTER_SPEED, st.one_of(_PASSING, aside.map(lambda step: [step, Step("wait", 1.5)])), least=1, most=3)


@makes("F3")
def _asked_on_the_way() -> SearchStrategy[Case]:
    """Speeds that are set, or refused, while the robot goes to a place."""
    goal = _goal(0, 3.0)
    return _case(st.just([goal, Step("wait", 0.5)]), st.one_of(_then_wait(_refused), _SPEED), least=1, most=2)


@makes("F3", "F11")
def _limited_meanwhile() -> SearchStrategy[Case]:
    """Limits that are changed while the robot drives, at a set speed or to a place."""
    goal = st.sampled_from([0, 90, 150]).map(lambda bearing: [_goal(bearing, 3.0), Step("wait", 0.8)])
    changed = st.sampled_from(
        [{"max_linear_speed": 0.25}, {"max_angular_speed": 0.5}, {"linear_acceleration": 0.25}]
    ).map(lambda to: [Step("set", dict(to)), Step("wait", 2.0)])  # fmt: skip
    asked = _set_speed(st.sampled_from([0.375, -0.375, 0.25, 0.5])).map(
        lambda step: [Step("set", {"max_linear_speed": 0.25}), Step("wait", 0.5), step, Step("wait", 0.5)]
    )
    return _case(st.one_of(goal, _AFTER_SPEED), st.one_of(changed, asked, changed, _SPEED), least=1, most=3)


@makes("F4")
def _watches() -> SearchStrategy[Case]:
    """Obstacles near a robot that drives: ahead, at the edge of its sector, moving, or nearer than the limit."""
    come = st.one_of(_at_the_edge, _in_the_way, _anywhere, _beside).map(lambda step: [step, Step("wait", 0.8)])
    later = st.one_of(come, come, come, _REMOVE, _SPEED)
    driving = st.tuples(_AFTER_SPEED, st.booleans()).map(lambda each: [*each[0], *([_wall] if each[1] else [])])
    bearing = st.sampled_from([140, -140, 100, -100])
    turning = st.tuples(bearing, _beside).map(
        lambda each: [_goal(each[0], 1.5), Step("wait", 0.5), each[1], Step("wait", 0.6)]
    )
    return _case(st.one_of(driving, driving, driving, turning), later, least=1)


@makes("F7")
def _asks() -> SearchStrategy[Case]:
    """The status, asked for at any time: standing, driving either way, beside things, on the way to a goal."""
    aside = _obstacle(st.one_of(st.integers(64, 88), st.integers(-88, -64)), st.integers(14, 22), moves=False)
    come = st.one_of(_in_the_way, aside, _anywhere).map(lambda step: [step, Step("wait", 0.6), _ASK, Step("wait", 0.3)])
    goal = st.just([_goal(0, 1.5), Step("wait", 0.8), _ASK])
    return _case(
        st.one_of(_AFTER_SPEED, _AFTER_SPEED, _then_wait(st.just(_ASK)), goal),
        st.one_of(come, come, _REMOVE, _AFTER_SPEED, _then_wait(st.just(_ASK))),
        st.just([_ASK]),
    )


@makes("F6")
def _spoilt() -> SearchStrategy[Case]:
    """Bad readings, with and without an obstacle among them, of a lidar with its own limits or others."""
    limits = st.sampled_from([[], [Step("limits", {"least": 0.25, "most": 10.0})]])
    first = st.tuples(limits, _AFTER_SPEED).map(lambda each: [*each[0], *each[1]])
    spoil = _readings.map(lambda step: [step, Step("wait", 0.8)])
    return _case(first, st.one_of(spoil, spoil, _then_wait(_true), _then_wait(_in_the_way), _REMOVE), least=1)


@makes("F8", "F9", "F10", "F11")
def _goes() -> SearchStrategy[Case]:
    """Goals, one after another: reached, cancelled, or with something in the way."""
    distance, tolerance = st.integers(1, 30).map(lambda n: n / 20), st.sampled_from([0.1, 0.25, 0.15])
    goal = st.builds(_goal, st.integers(-180, 180), distance, tolerance)
    block = _in_the_way.map(lambda step: [step, Step("wait", 1.5)])
    between = st.lists(st.one_of(block, _REMOVE, _then_wait(_refused)), max_size=2)
    arrive, cancel = Step("arrive", 12.0), Step("cancel", None)
    ends = st.sampled_from([[arrive], [cancel], [Step("remove", ""), arrive]])
    whole = st.tuples(goal, _wait, between, ends).map(
        lambda each: [each[0], each[1], *itertools.chain(*each[2]), *each[3], Step("wait", 1.4)]
    )
    held_up = st.tuples(st.sampled_from([0, 90, -40, 180]), st.sampled_from([0.5, 2.0]), ends).map(
        lambda each: [
            _goal(each[0], 1.5), Step("wait", each[1]),
            Step("obstacle", {"name": "pole", "bearing": 0, "distance": 0.4, "radius": 0.15}), Step("wait", 1.5),
            *each[2], Step("wait", 1.4),
        ]
    )  # fmt: skip
    return _case(st.one_of(whole, held_up, _SPEED), st.one_of(whole, _SPEED), most=2)


@makes("I8")
def _stops() -> SearchStrategy[Case]:
    """Ctrl-C at any time."""
    goal = st.just([_goal(90, 1.0), Step("wait", 0.5)])
    return _case(st.one_of(_SPEED, goal), st.one_of(_SPEED, _OBSTACLE), st.just([Step("interrupt", 5.0)]), most=2)
