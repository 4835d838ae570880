"""The robot in its world: motion, time, contacts, changes at run time."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sim import (
    COURSE,
    SUBSTEP_S,
    Box,
    Circle,
    ImuReading,
    Obstacle,
    OdometryReading,
    Path,
    Pose,
    ScanReading,
    Simulator,
    Twist,
    Wall,
    World,
    load_world,
    world_names,
)

WALL_AT_2 = World(obstacles=(Wall((2.0, -3.0), (2.0, 3.0), name="wall"),))


def exact(world: World = World()) -> Simulator:  # noqa: B008 - worlds are immutable
    return Simulator(world, noise=False)


# ------------------------------------------------------------------------------------------------------------ motion


def test_the_robot_drives_straight_at_the_commanded_speed() -> None:
    simulator = exact()
    simulator.command(0.4, 0.0)
    simulator.step(1.0)
    before = simulator.pose.x
    simulator.step(2.0)
    assert simulator.pose.x - before == pytest.approx(0.8, abs=1e-9)
    assert simulator.twist == Twist(0.4, 0.0)


def test_the_robot_drives_the_circle_that_v_and_omega_describe() -> None:
    """Radius v / omega = 0.5 m: at constant speed, a full turn leads back to the same position."""
    simulator = exact()
    simulator.command(0.25, 0.5)
    simulator.step(1.0)
    begin = simulator.pose
    turn_s = math.tau / 0.5
    simulator.step(round(turn_s / SUBSTEP_S) * SUBSTEP_S)
    assert simulator.pose.distance_to(begin) < 0.25 * SUBSTEP_S  # the turn is not a multiple of the substep


@pytest.mark.parametrize(
    ("v", "omega", "moved"),
    [(0.0, 1.0, (0.0, 0.0, 0.99)), (-0.3, 0.0, (-0.291, 0.0, 0.0))],
)
def test_a_positive_omega_turns_left_and_a_negative_speed_drives_backwards(v, omega, moved) -> None:
    simulator = exact()
    simulator.command(v, omega)
    simulator.step(1.0)
    pose = simulator.pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx(moved, abs=0.05)


def test_the_yaw_stays_within_pi() -> None:
    simulator = exact()
    simulator.command(0.0, 1.9)
    yaws = []
    for _ in range(200):
        simulator.step(0.05)
        yaws.append(simulator.pose.yaw)
    assert max(yaws) <= math.pi
    assert min(yaws) > -math.pi


def test_commands_are_limited() -> None:
    simulator = exact()
    simulator.command(3.0, -7.0)
    simulator.step(1.0)
    assert simulator.twist == Twist(0.5, -1.9)
    assert simulator.commanded == Twist(3.0, -7.0)


@pytest.mark.parametrize("bad", [(math.nan, 0.0), (0.0, math.inf), (-math.inf, 0.0)])
def test_a_command_that_is_not_finite_is_refused_and_the_old_one_stays_in_force(bad: tuple[float, float]) -> None:
    simulator = exact()
    simulator.command(0.2, 0.0)
    with pytest.raises(ValueError, match="not finite"):
        simulator.command(*bad)
    simulator.step(1.0)
    assert simulator.twist == Twist(0.2, 0.0)


# -------------------------------------------------------------------------------------------------------------- time


def test_time_never_drifts() -> None:
    simulator = exact()
    for _ in range(1000):
        simulator.step(0.05)
    assert simulator.time == 50.0


@pytest.mark.parametrize("dt", [0.0, -0.1, 0.001, 1 / 30, math.nan, math.inf])
def test_a_step_that_is_not_a_positive_multiple_of_the_substep_is_refused(dt: float) -> None:
    with pytest.raises(ValueError, match=r"multiple of 0\.005 s"):
        exact().step(dt)


def test_readings_come_at_their_rates_and_in_time_order() -> None:
    simulator = exact()
    readings = [reading for _ in range(40) for reading in simulator.step(0.05)]
    counts = {kind: sum(isinstance(r, kind) for r in readings) for kind in (ScanReading, OdometryReading, ImuReading)}
    assert counts == {ScanReading: 20, OdometryReading: 40, ImuReading: 200}
    stamps = [reading.stamp for reading in readings]
    assert stamps == sorted(stamps)
    assert [r.stamp for r in readings if isinstance(r, ScanReading)][:3] == [0.1, 0.2, 0.3]


def test_the_length_of_the_steps_makes_no_difference() -> None:
    def run(dt: float) -> list[object]:
        simulator = Simulator(load_world("forest"))
        simulator.command(0.4, 0.3)
        readings = [reading for _ in range(round(2.0 / dt)) for reading in simulator.step(dt)]
        return [(type(r), r.stamp, getattr(r, "ranges", np.zeros(0)).tobytes()) for r in readings] + [simulator.pose]

    assert run(0.005) == run(0.05) == run(2.0)


# ---------------------------------------------------------------------------------------------------------- contacts


def test_the_hull_stops_at_a_wall_and_the_contact_is_recorded() -> None:
    simulator = exact(WALL_AT_2)
    simulator.command(0.5, 0.0)
    simulator.step(5.0)
    (contact,) = simulator.contacts
    assert simulator.in_contact
    assert contact.obstacle == "wall"
    assert contact.speed == 0.5
    assert contact.point == pytest.approx((2.0, 0.0), abs=1e-6)
    assert simulator.pose.x == pytest.approx(2.0 - 0.171, abs=1e-6)
    assert simulator.pose.x < 2.0 - 0.171
    simulator.step(15.0)
    assert (len(simulator.contacts), simulator.twist.v) == (1, 0.0), "pressing on is the same contact"
    # 0.05 s are lost while speeding up from rest at 5 m/s².
    assert contact.time == pytest.approx((2.0 - 0.171) / 0.5 + 0.05, abs=0.006)


def test_the_robot_can_drive_away_from_a_wall_and_touch_it_again() -> None:
    simulator = exact(WALL_AT_2)
    simulator.command(0.5, 0.0)
    simulator.step(5.0)
    simulator.command(-0.3, 0.0)
    simulator.step(1.0)
    assert not simulator.in_contact
    assert simulator.clearance() > 0.2
    simulator.command(0.5, 0.0)
    simulator.step(2.0)
    assert [c.obstacle for c in simulator.contacts] == ["wall", "wall"]
    simulator.command(0.0, 1.0)
    simulator.step(math.ceil(math.pi / SUBSTEP_S) * SUBSTEP_S)
    simulator.command(0.3, 0.0)
    simulator.step(1.0)
    assert simulator.clearance() > 0.2


def test_in_a_corner_the_contacts_name_both_walls() -> None:
    corner = (Wall((1.0, -2.0), (1.0, 2.0), name="east"), Wall((-2.0, 1.0), (2.0, 1.0), name="north"))
    simulator = exact(World(obstacles=corner, start=Pose(0.0, 0.0, math.pi / 4)))
    simulator.command(0.5, 0.0)
    simulator.step(5.0)
    assert {c.obstacle for c in simulator.contacts} == {"east", "north"}


def test_clearance_is_measured_from_the_hull_and_infinite_without_obstacles() -> None:
    assert exact(WALL_AT_2).clearance() == pytest.approx(2.0 - 0.171)
    assert exact().clearance() == math.inf


def test_stalled_wheels_do_not_count_in_odometry() -> None:
    simulator = exact(WALL_AT_2)
    simulator.command(0.5, 0.0)
    simulator.step(10.0)
    assert simulator.odometry().pose.x == pytest.approx(simulator.pose.x, abs=0.003)


# ------------------------------------------------------------------------------------------------ changes at run time


def test_an_obstacle_can_be_added_and_removed() -> None:
    simulator = exact()
    name = simulator.add_obstacle(Box((1.0, 0.0), (0.2, 2.0)))
    assert name == "box 1"
    assert simulator.scan().ranges[180] == pytest.approx(0.9)
    assert simulator.clearance() == pytest.approx(0.9 - 0.171)
    simulator.remove_obstacle(name)
    assert np.isinf(simulator.scan().ranges).all()
    with pytest.raises(KeyError, match="no obstacle named"):
        simulator.remove_obstacle(name)


def test_an_obstacle_added_onto_the_robot_is_a_contact_and_the_robot_can_leave() -> None:
    simulator = exact()
    simulator.add_obstacle(Circle((0.25, 0.0), 0.2, name="stone"))
    assert [c.obstacle for c in simulator.contacts] == ["stone"]
    simulator.command(0.3, 0.0)
    simulator.step(1.0)
    assert simulator.pose.x < 0.01
    simulator.command(-0.3, 0.0)
    simulator.step(1.0)
    assert simulator.clearance() > 0.1


def test_obstacles_appear_and_vanish_at_their_times() -> None:
    box = Box((1.0, 0.0), (0.2, 2.0), name="box", appears=1.0, vanishes=2.0)
    simulator = exact(World(obstacles=(box,)))
    seen = []
    for _ in range(30):
        simulator.step(0.1)
        seen.append(bool(np.isfinite(simulator.scan().ranges[180])))
    assert seen == [False] * 9 + [True] * 10 + [False] * 11
    assert [(e.time, e.kind, e.subject) for e in simulator.events] == [
        (1.0, "appears", "box"),
        (2.0, "vanishes", "box"),
    ]


def test_obstacles_appear_vanish_and_move_on_an_event() -> None:
    world = World(
        obstacles=(
            Box((1.0, 0.0), (0.2, 2.0), name="door", vanishes="open"),
            Circle((0.0, 2.0), 0.2, name="guard", appears="open"),
            Circle((5.0, 0.0), 0.2, name="cart", motion=Path(((6.0, 0.0),), 1.0, starts="open")),
        )
    )
    simulator = exact(world)
    simulator.step(1.0)
    assert {o.name for o, _ in simulator.obstacles} == {"door", "cart"}
    simulator.trigger("open")
    simulator.step(0.5)
    places = {o.name: place for o, place in simulator.obstacles}
    assert set(places) == {"guard", "cart"}
    assert places["cart"] == pytest.approx((5.5, 0.0))


# ------------------------------------------------------------------------------------------------- random commands

away = st.floats(-3, 3).map(lambda v: round(v, 3))
spot = st.tuples(away, away).filter(lambda p: math.hypot(*p) > 0.9)
motions = st.none() | st.builds(
    Path, st.lists(st.tuples(away, away), min_size=1, max_size=3).map(tuple), st.floats(0.1, 2.0)
)
standing = st.lists(
    st.builds(Box, spot, st.tuples(st.floats(0.05, 0.8), st.floats(0.05, 0.8)), away)
    | st.builds(Circle, spot, st.floats(0.05, 0.6), motion=motions)
    | st.builds(lambda p, q: Wall(p, (q[0] + 0.01, q[1])), spot, spot),
    max_size=8,
)
commands = st.lists(st.tuples(st.floats(-0.6, 0.6), st.floats(-2, 2)), min_size=1, max_size=12)


@settings(max_examples=60, derandomize=True, database=None)
@given(standing, commands)
@example(  # leaving an obstacle slowly, the contact once lasted a millimetre too long
    [Box((0.0, 1.0), (0.5, 0.5)), Wall((1.0, 0.0), (-0.99, 0.0)), Box((0.0, 1.0), (0.5, 0.5))],
    [
        *((-0.25390625, -0.5), (-0.15234375, -0.421875), (0.0, -0.375), (0.2734375, 0.71484375)),
        *((0.0, 1.28125), (0.0, -1.177734375), (-0.091796875, -1.78125), (0.5, -0.09375)),
        *((-0.10546875, 0.25), (0.0, -1.421875), (0.0625, 1.78125), (-0.0859375, 0.5)),
    ],
)
def test_the_hull_never_enters_an_obstacle_and_every_contact_is_recorded(
    obstacles: list[Obstacle], twists: list[tuple[float, float]]
) -> None:
    simulator = exact(World(obstacles=tuple(obstacles)))
    inside_from_the_start = simulator.clearance() < 0
    for v, omega in twists:
        simulator.command(v, omega)
        for _ in range(12):
            simulator.step(0.05)
            gap = simulator.clearance()
            assert gap >= -1e-9 or inside_from_the_start
            assert simulator.in_contact or gap > 0
            assert not simulator.in_contact or gap <= 1.1e-3
            assert not (simulator.in_contact and not simulator.contacts)


# -------------------------------------------------------------------------------------------------- moving obstacles


def cart(motion: Path) -> Simulator:
    return exact(World(obstacles=(Circle((3.0, 0.0), 0.3, name="cart", motion=motion),)))


def place(simulator: Simulator, name: str = "cart") -> tuple[float, float]:
    return next(p for o, p in simulator.obstacles if o.name == name)


CORNERS = ((4.0, 0.0), (4.0, 1.0), (3.0, 1.0))


@pytest.mark.parametrize(
    ("path", "at_3_s", "at_7_s"),
    [
        (Path(((3.0, 1.0), (4.0, 1.0)), speed=0.5), (3.5, 1.0), (4.0, 1.0)),
        (Path(((3.0, 1.0),), speed=0.5, repeat="back_and_forth"), (3.0, 0.5), (3.0, 0.5)),
        (Path(CORNERS, speed=0.5, repeat="loop"), (4.0, 0.5), (3.0, 0.5)),
    ],
    ids=["once", "back and forth", "loop"],
)
def test_a_cart_follows_its_waypoints(path: Path, at_3_s, at_7_s) -> None:
    simulator = cart(path)
    simulator.step(3.0)
    assert place(simulator) == pytest.approx(at_3_s)
    simulator.step(4.0)
    assert place(simulator) == pytest.approx(at_7_s)


def test_the_lidar_measures_a_moving_obstacle_at_its_position() -> None:
    simulator = cart(Path(((5.0, 0.0),), speed=0.5))
    assert simulator.true_ranges()[180] == pytest.approx(2.7)
    simulator.step(2.0)
    assert simulator.true_ranges()[180] == pytest.approx(3.7)
    assert simulator.clearance() == pytest.approx(3.7 - 0.171)


def test_a_cart_that_runs_into_the_robot_is_a_contact_and_goes_on_when_the_way_is_free() -> None:
    simulator = cart(Path(((-3.0, 0.0),), speed=0.5))
    simulator.step(10.0)
    (contact,) = simulator.contacts
    assert (contact.obstacle, contact.speed) == ("cart", 0.0)
    assert simulator.pose == Pose()
    assert simulator.clearance() >= 0.0
    simulator.command(0.0, math.pi / 2)
    simulator.step(1.0)
    simulator.command(0.5, 0.0)
    simulator.step(10.0)
    assert place(simulator)[0] < -1.5


def test_a_walker_starts_when_the_robot_comes_near() -> None:
    simulator = cart(Path(((3.0, 2.0),), speed=0.5, wakes_within=2.0))
    simulator.step(2.0)
    assert place(simulator) == (3.0, 0.0)
    simulator.command(0.5, 0.0)
    simulator.step(4.0)
    assert 0.5 < place(simulator)[1] < 1.5


def test_a_considerate_cart_yields_to_the_robot() -> None:
    simulator = cart(Path(((-3.0, 0.0),), speed=0.5, yields_within=1.0))
    simulator.step(20.0)
    assert not simulator.contacts
    assert place(simulator)[0] == pytest.approx(1.0, abs=0.01)


# --------------------------------------------------------------------------------------------------- moved obstacles


def test_a_moved_obstacle_is_at_its_new_position_for_lidar_and_hull() -> None:
    simulator = exact(World(obstacles=(Box((2.0, 1.0), (0.4, 0.4), name="crate"),)))
    simulator.move_obstacle("crate", 1.0, 0.0)
    assert simulator.true_ranges()[180] == pytest.approx(0.8)
    assert simulator.clearance() == pytest.approx(0.8 - 0.171)
    assert place(simulator, "crate") == (1.0, 0.0)


def test_a_moved_obstacle_remains_the_same_obstacle() -> None:
    simulator = exact(World(obstacles=(Box((2.0, 1.0), (0.4, 0.4), name="crate"),)))
    for x in (1.0, 1.5, 2.5):
        simulator.step(0.5)
        simulator.move_obstacle("crate", x, 1.0)
    (presence,) = simulator.presences
    assert (presence.since, presence.until) == (0.0, math.inf)
    assert [(e.time, e.kind, e.subject) for e in simulator.events] == [(t, "moved", "crate") for t in (0.5, 1.0, 1.5)]
    assert simulator.moved == {"crate"}
    simulator.reset()
    assert (place(simulator, "crate"), simulator.moved) == ((2.0, 1.0), frozenset())


def test_a_moved_cart_follows_its_shifted_path_without_waiting_for_its_event_again() -> None:
    simulator = cart(Path(((3.0, 4.0),), speed=0.5, starts="go"))
    simulator.trigger("go")
    simulator.step(2.0)
    simulator.move_obstacle("cart", 5.0, 1.0)
    simulator.step(2.0)
    assert place(simulator) == pytest.approx((5.0, 2.0))


def test_an_obstacle_moved_before_it_appears_appears_at_its_new_position() -> None:
    simulator = exact(World(obstacles=(Circle((2.0, 0.0), 0.2, name="ghost", appears=1.0),)))
    simulator.move_obstacle("ghost", 3.0, 0.0)
    assert simulator.obstacles == ()
    simulator.step(1.0)
    assert place(simulator, "ghost") == (3.0, 0.0)


def test_an_obstacle_moved_onto_the_robot_is_one_contact_however_often_it_moves_on() -> None:
    simulator = exact(World(obstacles=(Circle((2.0, 0.0), 0.2, name="stone"),)))
    for x in (0.3, 0.31, 0.32):
        simulator.move_obstacle("stone", x, 0.0)
        simulator.step(0.1)
    assert [contact.obstacle for contact in simulator.contacts] == ["stone"]


def test_a_robot_stopped_by_an_obstacle_drives_on_when_that_is_moved_away() -> None:
    simulator = exact(World(obstacles=(Box((1.0, 0.0), (0.2, 1.0), name="crate"),)))
    simulator.command(0.5, 0.0)
    simulator.step(3.0)
    simulator.move_obstacle("crate", 5.0, 5.0)
    simulator.step(1.0)
    assert simulator.pose.x > 1.0


def test_an_absent_obstacle_or_an_infinite_position_is_refused() -> None:
    simulator = exact(WALL_AT_2)
    with pytest.raises(KeyError, match="no obstacle named 'crate'"):
        simulator.move_obstacle("crate", 0.0, 0.0)
    with pytest.raises(ValueError, match="not finite"):
        simulator.move_obstacle("wall", math.nan, 0.0)
    assert simulator.moved == frozenset()


# ------------------------------------------------------------------------------------------------------------- reset


def test_a_reset_restores_pose_time_obstacles_and_battery() -> None:
    simulator = exact(load_world("moving_cart"))
    simulator.command(0.5, 0.2)
    simulator.step(6.0)
    simulator.add_obstacle(Circle((0.0, 0.0), 0.1))
    simulator.set_battery(0.1)
    simulator.reset()
    fresh = exact(load_world("moving_cart"))
    assert (simulator.time, simulator.pose, simulator.contacts) == (0.0, fresh.pose, ())
    assert simulator.obstacles == fresh.obstacles
    assert simulator.battery().percentage == 1.0
    assert simulator.twist == simulator.commanded == Twist()


@pytest.mark.parametrize("name", world_names())
def test_every_world_loads_and_has_space_for_the_robot(name: str) -> None:
    world = load_world(name)
    simulator = Simulator(world)
    assert simulator.clearance() > 0.1
    assert not simulator.contacts
    for goal in world.goals:
        assert Simulator(replace(world, start=goal)).clearance() > 0.05, goal


@pytest.mark.parametrize("name", world_names())
def test_a_transformed_world_is_the_same_to_the_robot(name: str) -> None:
    """Metamorphic: scans and contacts do not depend on the position and orientation of the world."""
    world = load_world(name)
    original = exact(world)
    moved = exact(world.transformed(rotate=1.1, shift=(20.0, -7.0)))
    mirrored = exact(world.transformed(mirror=True))
    for simulator, side in ((original, 1.0), (moved, 1.0), (mirrored, -1.0)):
        simulator.command(0.4, 0.25 * side)
        simulator.step(4.0)
    assert moved.true_ranges() == pytest.approx(original.true_ranges(), abs=1e-6)
    # Beam i of the mirrored scan is beam -i; index 180 points ahead.
    assert np.roll(mirrored.true_ranges()[::-1], 1) == pytest.approx(original.true_ranges(), abs=1e-6)
    for other in (moved, mirrored):
        assert [(c.obstacle, c.time) for c in other.contacts] == [(c.obstacle, c.time) for c in original.contacts]


def test_another_seed_changes_only_the_noise() -> None:
    world = load_world("forest")
    a, b = Simulator(world), Simulator(world.transformed(seed=99))
    assert a.true_ranges().tolist() == b.true_ranges().tolist()
    assert a.scan().ranges.tolist() != b.scan().ranges.tolist()


def test_the_course_robot_is_the_contracts() -> None:
    lidar = COURSE.lidar
    assert (COURSE.radius, COURSE.drive.max_v, COURSE.drive.max_omega) == (0.171, 0.5, 1.9)
    assert (lidar.beams.count, lidar.range_min, lidar.beams.range_max, lidar.rate_hz) == (360, 0.15, 12.0, (10.0, 10.0))
    assert lidar.pose == Pose()
