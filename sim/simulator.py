"""The simulator: one robot in a world, advanced in steps of simulated time. No ROS, no drawing, no wall clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim.geometry import Point, Pose, Twist, advance, normalize_angle
from sim.inventory import Event, Inventory, Presence
from sim.movers import Mover
from sim.obstacles import Obstacle
from sim.robot import COURSE, RobotProfile
from sim.scene import Nearest
from sim.sensors import (
    GRAVITY,
    BatteryReading,
    ImuModel,
    ImuReading,
    LidarModel,
    OdometryModel,
    OdometryReading,
    Reading,
    ScanReading,
    Vector,
)
from sim.world import World, free_name

SUBSTEPS_PER_S = 200
SUBSTEP_S = 1 / SUBSTEPS_PER_S
TOUCH_M = 1e-6  # a hull nearer than this touches the obstacle
PART_M = 1e-3  # beyond this distance a contact is over
LOOK_M = 1.0  # how far from the hull a substep looks for obstacles


@dataclass(frozen=True)
class Contact:
    """The hull met an obstacle.

    Attributes:
        time: simulated time in s at which the contact began.
        obstacle: the obstacle's name.
        point: on the obstacle's surface, map frame, m.
        speed: of the robot at that moment, m/s, never negative; 0 if an obstacle ran into a standing robot.
    """

    time: float
    obstacle: str
    point: Point
    speed: float


class Simulator:
    """A robot in a world. The same world, profile, seed and commands give bit-identical readings, in any process.

    | | |
    |---|---|
    | physics | 200 substeps a second, counted as integers, so that time never drifts |
    | drive | `profile.drive`; a command holds until the next one (or the profile's timeout) |
    | contact | is recorded and stops the hull at the surface; the robot can turn and drive away |
    | moving obstacle | stops at the hull, which is recorded as a contact, and goes on when the way is free |
    | sensors | each has its own rate and random stream; `noise=False` makes all of them exact |

    >>> from sim import Simulator, World
    >>> simulator = Simulator(World(), noise=False)
    >>> simulator.command(0.5, 0.0)
    >>> readings = simulator.step(1.0)
    >>> round(simulator.pose.x, 3)
    0.476
    """

    def __init__(
        self, world: World, profile: RobotProfile = COURSE, seed: int | None = None, noise: bool = True
    ) -> None:
        self.world = world
        self.profile = profile
        self.noise = noise
        self._seed = world.seed if seed is None else seed
        self.unrepeatable = ""
        """Why another run with the same seed may differ, in one sentence; "" if there is no reason.

        The code that commands the robot sets it, for example a bridge to a node with threads of its own.
        """
        self.reset()

    # ------------------------------------------------------------------ time

    def reset(self, seed: int | None = None) -> None:
        """Go back to the start. With the same seed (by default the current one) the same commands give the same run."""
        if seed is not None:
            self._seed = seed
        p = self.profile
        self.unrepeatable = ""
        self._tick = 0
        self._contacts: list[Contact] = []
        self._events: list[Event] = []
        self._inventory = Inventory(self.world.obstacles, self._events)
        self._scene, self._movers = self._inventory.scene, self._inventory.movers
        self._touching: frozenset[str] = frozenset()
        self._refuses_backing = False
        self._lidar = LidarModel(p.lidar, self._seed, self.noise)
        self._imu = ImuModel(p.imu, self._seed, self.noise)
        self._odometry = OdometryModel(p.odometry, self._seed, self.noise)
        self._charge = 1.0
        self._command, self._command_tick = Twist(), 0
        self._target = Twist()
        self._backed = 0.0
        self._v = self._omega = self._v_before = 0.0
        start = self.world.start
        self._x, self._y, self._yaw = start.x, start.y, normalize_angle(start.yaw)
        self._odom_origin = self.pose if p.odometry.starts_at_zero else Pose()
        odom = self._odom_origin.inverse().compose(self.pose)
        self._odom = (odom.x, odom.y, odom.yaw)
        self._free = 0.0  # metres that the hull can certainly move before it touches anything
        self._pressed: Nearest | None = None  # the surface that has stopped the hull
        self._schedule = [
            _Due(p.imu.rate_hz, ImuReading, self.imu),
            _Due(p.odometry.rate_hz, OdometryReading, self.odometry),
            _Due(self._lidar.rate_hz, ScanReading, self.scan),
            _Due(p.battery.rate_hz, BatteryReading, self.battery),
        ]
        self._next_due = min(due.tick for due in self._schedule)
        self._note_contacts(0.0)

    def step(self, dt: float, without: Collection[type[Reading]] = ()) -> list[Reading]:
        """Advance simulated time by dt seconds; return the readings that were due in (t, t + dt], in time order.

        Readings of the types `without` are left out, and cost nothing.

        Raises:
            ValueError: dt is not a positive multiple of the substep of 5 ms.
        """
        substeps = round(dt * SUBSTEPS_PER_S) if math.isfinite(dt) else 0
        if substeps < 1 or abs(substeps - dt * SUBSTEPS_PER_S) > 1e-6:
            raise ValueError(f"dt = {dt!r} s is not a positive multiple of {SUBSTEP_S} s, the length of a substep")
        readings: list[Reading] = []
        for _ in range(substeps):
            self._substep()
            if self._tick >= self._next_due:
                due_now = [due for due in self._schedule if due.falls_on(self._tick)]
                readings += [due.read() for due in due_now if due.kind not in without]
                self._next_due = min(due.tick for due in self._schedule)
        return readings

    @property
    def time(self) -> float:
        """Simulated time since the reset, in s: a multiple of the substep."""
        return self._tick / SUBSTEPS_PER_S

    @property
    def seed(self) -> int:
        """The seed of all noise."""
        return self._seed

    # ------------------------------------------------------------- commands

    def command(self, v: float, omega: float) -> None:
        """Set the twist to follow from now on, m/s and rad/s, limited to what the profile's drive can do.

        Raises:
            ValueError: a number is not finite; the previous command stays in force.
        """
        if not (math.isfinite(v) and math.isfinite(omega)):
            raise ValueError(f"command ({v}, {omega}) is not finite; give m/s and rad/s")
        self._command, self._command_tick = Twist(v, omega), self._tick
        self._target = self.profile.drive.limited(v, omega)

    @property
    def commanded(self) -> Twist:
        """The last command, before limiting."""
        return self._command

    # ---------------------------------------------------------- ground truth

    @property
    def pose(self) -> Pose:
        """The robot's true pose, map frame."""
        return Pose(self._x, self._y, self._yaw)

    @property
    def twist(self) -> Twist:
        """The robot's true twist, base_link."""
        return Twist(self._v, self._omega)

    @property
    def odom_origin(self) -> Pose:
        """The odometry frame's pose in the map frame at the start; drift comes on top later."""
        return self._odom_origin

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """Every contact since the reset, in time order."""
        return tuple(self._contacts)

    @property
    def in_contact(self) -> bool:
        """Whether the hull touches something now."""
        return bool(self._touching)

    @property
    def events(self) -> tuple[Event, ...]:
        """Everything but the robot's motion, in time order: contacts, hazards, triggers, changes of obstacles."""
        return tuple(self._events)

    @property
    def obstacles(self) -> tuple[tuple[Obstacle, Point], ...]:
        """The obstacles that are present, each with the position of its centre."""
        return tuple((o, self._scene.position(o.name)) for o in self._scene.obstacles)

    @property
    def presences(self) -> tuple[Presence, ...]:
        """Every obstacle since the reset, as it was added, with the times between which it was present."""
        return tuple(self._inventory.presences)

    @property
    def moved(self) -> frozenset[str]:
        """The names of the obstacles that `move_obstacle` has put elsewhere."""
        return self._inventory.moved

    def clearance(self) -> float:
        """Return the distance from the hull to the nearest surface in m: inf without obstacles, below 0 inside one."""
        nearest = self._scene.nearest(self._x, self._y)
        return nearest.distance - self.profile.radius if nearest else math.inf

    def true_ranges(self) -> NDArray[np.float64]:
        """Return the exact range of each lidar beam in m: inf where nothing is in range, 0 inside an obstacle."""
        return self._scene.cast(self.pose.compose(self.profile.lidar.pose), self.profile.lidar.beams)

    # --------------------------------------------------------------- sensors

    def scan(self) -> ScanReading:
        """Return the lidar's reading at this moment. Reading has no side effects; a second call returns the same."""
        return self._lidar.scan(self.true_ranges(), self._tick, self.time)

    def odometry(self) -> OdometryReading:
        """Return the pose and twist by wheel odometry."""
        measured = self._odometry.measured(self._v * SUBSTEP_S, self._omega * SUBSTEP_S, self._tick)
        twist = Twist(measured[0] * SUBSTEPS_PER_S, measured[1] * SUBSTEPS_PER_S)
        return OdometryReading(self.time, Pose(*self._odom), twist)

    def imu(self) -> ImuReading:
        """Return the IMU's reading at this moment."""
        forward = (self._v - self._v_before) * SUBSTEPS_PER_S
        force: Vector = (forward, self._v * self._omega, GRAVITY)
        return self._imu.read(self._odom[2], force, self._omega, self._tick, self.time)

    def battery(self) -> BatteryReading:
        """Return the battery's state."""
        p = self.profile.battery
        current = p.current_driving if self._is_driving else p.current_idle
        return BatteryReading(self.time, self._charge, p.voltage(self._charge), current)

    # ---------------------------------------------------- changes at run time

    def add_obstacle(self, obstacle: Obstacle) -> str:
        """Add an obstacle and return its name; one without a name is given one."""
        if not obstacle.name:
            taken = {o.name for o in self._scene.obstacles} | set(self._inventory.waiting)
            obstacle = replace(obstacle, name=free_name(type(obstacle).__name__.lower(), taken))
        self._inventory.introduce(obstacle, self.time)
        self._note_contacts(abs(self._v))
        return obstacle.name

    def remove_obstacle(self, name: str) -> None:
        """Remove an obstacle.

        Raises:
            KeyError: there is no obstacle of that name.
        """
        self._inventory.withdraw(name, self.time)
        self._touching -= {name}
        self._pressed = None

    def move_obstacle(self, name: str, x: float, y: float) -> None:
        """Put an obstacle's centre at x, y (m, map frame) at once; its yaw stays.

        It remains the same obstacle: a recording shows one, with its path. An obstacle that moves by itself restarts
        its path, shifted to the new position. The centre is `obstacle.pose`: a wall's middle, a map's lower left
        corner. If the hull is there, that is a contact.

        Raises:
            KeyError: there is no obstacle of that name.
            ValueError: x or y is not finite.
        """
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ValueError(f"({x}, {y}) is not finite; give metres in the map frame")
        self._inventory.move(name, x, y, self.time)
        self._note_contacts(abs(self._v))

    def set_battery(self, percentage: float) -> None:
        """Set the charge, 0 to 1.

        Raises:
            ValueError: it is not a number from 0 to 1.
        """
        if not 0.0 <= percentage <= 1.0:
            raise ValueError(f"battery percentage {percentage} is not from 0 to 1")
        self._charge = float(percentage)

    def trigger(self, event: str) -> None:
        """Let an event happen: the obstacles that wait for it appear, vanish or start to move."""
        self._events.append(Event(self.time, "trigger", event))
        self._inventory.hear(event, self.time)
        self._note_contacts(abs(self._v))

    # ---------------------------------------------------------------- inside

    @property
    def _is_driving(self) -> bool:
        return self._v != 0.0 or self._omega != 0.0

    def _substep(self) -> None:
        self._tick += 1
        if self._inventory.has_timetable and self._inventory.follow_timetable(self.time):
            self._note_contacts(abs(self._v))
        if self._movers:
            self._move_obstacles()
        self._drive()
        battery = self.profile.battery
        drain = battery.drain_driving if self._is_driving else battery.drain_idle
        self._charge = max(0.0, self._charge - drain * SUBSTEP_S)

    def _drive(self) -> None:
        """Accelerate towards the command, move along an exact arc, stop at an obstacle in the way."""
        v, omega = self._next_speed()
        self._v_before = self._v
        self._v, self._omega = v, omega
        if v == 0.0 and omega == 0.0:
            return
        ds, dyaw = v * SUBSTEP_S, omega * SUBSTEP_S
        x, y, yaw = advance(self._x, self._y, self._yaw, ds, dyaw)
        self._free -= abs(ds)
        if self._free < 0.0 and ds != 0.0 and not self._is_clear(x, y):
            x, y = self._stop_at_surface(x, y)
            ds = 0.0
        self._x, self._y, self._yaw = x, y, yaw
        self._backed -= ds
        measured = self._odometry.measured(ds, dyaw, self._tick)
        self._odom = advance(*self._odom, *measured)

    def _next_speed(self) -> tuple[float, float]:
        drive = self.profile.drive
        target = self._target
        if (
            drive.command_timeout is not None
            and self._tick - self._command_tick > drive.command_timeout * SUBSTEPS_PER_S
        ):
            target = Twist()
        if drive.backup_limit is not None:
            target = self._guard_back(target, drive.backup_limit)
        if target.v == self._v and target.omega == self._omega:
            return target.v, target.omega
        reached = drive.toward(Twist(self._v, self._omega), target, SUBSTEP_S)
        return reached.v, reached.omega

    def _guard_back(self, target: Twist, limit: float) -> Twist:
        """Refuse to reverse further than the limit, as a Create 3 does: it has no cliff sensors at the back."""
        refused = target.v < 0.0 and self._backed >= limit
        if refused != self._refuses_backing:
            self._refuses_backing = refused
            self._events.append(Event(self.time, "hazard" if refused else "hazard over", "BACKUP_LIMIT"))
        return Twist(0.0, target.omega) if refused else target

    def _is_clear(self, x: float, y: float) -> bool:
        """Return whether the hull may move to x, y; remember how far it can go from there without another query."""
        if self._pressed is not None and self._leads_into(self._pressed, x, y):
            return False
        self._pressed = None
        self._free = gap = self._gap(x, y)
        if gap >= PART_M:
            self._touching = frozenset()
        elif self._touching:
            self._touching = self._touching & frozenset(hit.name for hit in self._touched(x, y, PART_M))
        if self._touching:
            self._free = 0.0  # otherwise the end of the contact would be noticed late
        # A hull that touches an obstacle, or was put inside one, may leave.
        return gap >= 0.0 or gap >= self._gap(self._x, self._y)

    def _gap(self, x: float, y: float) -> float:
        """Return the clearance of a hull at x, y, at most `LOOK_M`."""
        nearest = self._scene.nearest(x, y, self.profile.radius + LOOK_M)
        return nearest.distance - self.profile.radius if nearest else LOOK_M

    def _leads_into(self, pressed: Nearest, x: float, y: float) -> bool:
        """Return whether the way to x, y leads towards the surface that the stopped hull is pressed against."""
        return (x - self._x) * (pressed.point[0] - self._x) + (y - self._y) * (pressed.point[1] - self._y) > 0.0

    def _stop_at_surface(self, x: float, y: float) -> Point:
        """Return the last free position on the way to x, y; record the contact and stall the wheels."""
        speed = abs(self._v)
        self._v = 0.0
        self._free = 0.0
        if self._pressed is not None:
            return self._x, self._y
        free, blocked = 0.0, 1.0
        if self._gap(self._x, self._y) > TOUCH_M:
            for _ in range(30):
                middle = (free + blocked) / 2
                if self._gap(self._x + middle * (x - self._x), self._y + middle * (y - self._y)) < 0.0:
                    blocked = middle
                else:
                    free = middle
        x, y = self._x + free * (x - self._x), self._y + free * (y - self._y)
        touched = self._touched(x, y, TOUCH_M)
        self._record(touched, speed)
        nearest = min(touched, key=lambda hit: hit.distance, default=None)
        if nearest is not None and nearest.distance > 0.0 and nearest.name not in self._movers:
            self._pressed = nearest
        return x, y

    def _touched(self, x: float, y: float, reach: float) -> list[Nearest]:
        return self._scene.within(x, y, self.profile.radius + reach)

    def _note_contacts(self, speed: float) -> None:
        """Record what touches the hull at its position, after the robot or an obstacle has been placed."""
        self._free = 0.0
        self._pressed = None
        touched = self._touched(self._x, self._y, TOUCH_M)
        self._touching &= frozenset(hit.name for hit in touched)
        self._record(touched, speed)

    def _record(self, touched: list[Nearest], speed: float) -> None:
        for hit in touched:
            if hit.name not in self._touching:
                self._contacts.append(Contact(self.time, hit.name, hit.point, speed))
                self._events.append(Event(self.time, "contact", hit.name))
        self._touching |= frozenset(hit.name for hit in touched)

    def _move_obstacles(self) -> None:
        now = self.time
        for name, mover in self._movers.items():
            moved = mover.advance(SUBSTEP_S, now, self._x, self._y)
            if moved == 0.0:
                continue
            self._scene.move(name, mover.x, mover.y)
            self._free -= moved
            if self._free < 0.0:
                self._check_mover(name, mover)

    def _check_mover(self, name: str, mover: Mover) -> None:
        """Stop an obstacle that would run into the hull, and record the contact."""
        self._pressed = None
        self._free = gap = self._gap(self._x, self._y)
        if gap >= PART_M:
            self._touching = frozenset()
        if gap >= 0.0:
            return
        if not any(hit.name == name for hit in self._touched(self._x, self._y, 0.0)):
            return
        free, blocked = 0.0, 1.0
        while blocked - free > 1e-6 and not (free == 0.0 and self._gap_with(name, mover, 0.0) <= TOUCH_M):
            middle = (free + blocked) / 2
            if self._gap_with(name, mover, middle) < 0.0:
                blocked = middle
            else:
                free = middle
        self._free = max(0.0, self._gap_with(name, mover, free))
        self._record([hit for hit in self._touched(self._x, self._y, TOUCH_M) if hit.name == name], abs(self._v))

    def _gap_with(self, name: str, mover: Mover, part: float) -> float:
        """Move the mover by only a part of its last step and return the clearance there."""
        mover.hold(part)
        self._scene.move(name, mover.x, mover.y)
        return self._gap(self._x, self._y)


class _Due:
    """When a sensor's readings are due: at the first substep at or after n / rate, for n = 1, 2, 3 ..."""

    def __init__(self, rate_hz: float, kind: type[Reading], read: Callable[[], Reading]) -> None:
        self.kind, self.read = kind, read
        self._period = SUBSTEPS_PER_S / rate_hz
        self._count = 1
        self.tick = self._tick_of(1)

    def _tick_of(self, count: int) -> int:
        return math.ceil(count * self._period - 1e-9)

    def falls_on(self, tick: int) -> bool:
        """Return whether a reading is due at this substep; if so, schedule the next."""
        if tick < self.tick:
            return False
        self._count += 1
        self.tick = self._tick_of(self._count)
        return True
