"""The simulator: one robot in a world, stepped in simulated time. No ROS, no drawing, no wall clock."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.geometry import Point, Pose, Twist, advance, normalize_angle
from sim.inventory import Event, Inventory, Presence
from sim.movers import Mover
from sim.obstacles import Obstacle, with_name
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
TOUCH_M = 1e-6  # nearer than this the hull touches
PART_M = 1e-3  # further than this a contact is over
LOOK_M = 1.0  # further than this from the hull nothing is looked for in a substep


@dataclass(frozen=True)
class Contact:
    """The hull met an obstacle.

    Attributes:
        time: simulated time in s at which it began.
        obstacle: the obstacle's name.
        point: on the obstacle's surface, map frame, m.
        speed: of the robot at that moment, m/s, never negative; 0 when an obstacle came to a standing robot.
    """

    time: float
    obstacle: str
    point: Point
    speed: float


class Simulator:
    """A robot in a world. Same world, profile, seed and commands: bit-equal readings, in any process.

    | | |
    |---|---|
    | physics | 200 substeps a second, counted in whole numbers, so that time never drifts |
    | drive | `profile.drive`; the command in force stays until the next one (or the profile's time-out) |
    | contact | the hull stops at the surface and is recorded; it can turn, and drive away |
    | moving obstacle | stops at the hull, is recorded as a contact, goes on when the way is free |
    | sensors | each at its own rate and with its own random stream; `noise=False` makes all of them exact |

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
        """Why another run need not be the same though the seed is, in one sentence; "" if nothing speaks against it.

        Whoever commands the robot says so, for example a bridge to a node with threads of its own.
        """
        self.reset()

    # ------------------------------------------------------------------ time

    def reset(self, seed: int | None = None) -> None:
        """Go back to the start. The same seed (the one in force, unless one is given) brings the same future."""
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
        self._hazards: frozenset[str] = frozenset()
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
        self._start_odometry()
        self._free = 0.0  # metres that the hull can certainly go before it touches anything
        self._pressed: Nearest | None = None  # the surface that has stopped the hull
        self._schedule = [
            _Due(p.imu.rate_hz, self.imu),
            _Due(p.odometry.rate_hz, self.odometry),
            _Due(self._lidar.rate_hz, self.scan),
            _Due(p.battery.rate_hz, self.battery),
        ]
        self._next_due = min(due.tick for due in self._schedule)
        self._note_contacts(0.0)

    def step(self, dt: float) -> list[Reading]:
        """Advance simulated time by dt seconds; return the readings that fell due in (t, t + dt], in time order.

        Raises:
            ValueError: dt is not a whole number of substeps of 5 ms, or none.
        """
        substeps = round(dt * SUBSTEPS_PER_S) if math.isfinite(dt) else 0
        if substeps < 1 or abs(substeps - dt * SUBSTEPS_PER_S) > 1e-6:
            raise ValueError(f"dt = {dt!r} s is not a whole number of substeps; take a multiple of {SUBSTEP_S} s")
        readings: list[Reading] = []
        for _ in range(substeps):
            self._substep()
            if self._tick >= self._next_due:
                readings += [due.read() for due in self._schedule if due.falls_on(self._tick)]
                self._next_due = min(due.tick for due in self._schedule)
        return readings

    @property
    def time(self) -> float:
        """Simulated time since the reset, in s: a whole number of substeps."""
        return self._tick / SUBSTEPS_PER_S

    @property
    def seed(self) -> int:
        """The seed of all noise."""
        return self._seed

    # ------------------------------------------------------------- commands

    def command(self, v: float, omega: float) -> None:
        """Set the twist to be followed from now on, m/s and rad/s. It is cut to what the profile's drive can do.

        Raises:
            ValueError: a number is not finite; the command in force stays.
        """
        if not (math.isfinite(v) and math.isfinite(omega)):
            raise ValueError(f"command ({v}, {omega}) is not finite; give m/s and rad/s")
        self._command, self._command_tick = Twist(v, omega), self._tick
        self._target = self.profile.drive.limited(v, omega)

    @property
    def commanded(self) -> Twist:
        """The last command as it was given."""
        return self._command

    # ---------------------------------------------------------- ground truth

    @property
    def pose(self) -> Pose:
        """Where the robot's centre truly is, map frame."""
        return Pose(self._x, self._y, self._yaw)

    @property
    def twist(self) -> Twist:
        """How the robot truly moves, base_link."""
        return Twist(self._v, self._omega)

    @property
    def odom_origin(self) -> Pose:
        """The odometry frame's pose in the map frame, as it was at the start (later drift comes on top)."""
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
        """What happened beside the robot's motion: contacts, appearances, moves by hand, triggers, hazards."""
        return tuple(self._events)

    @property
    def hazards(self) -> frozenset[str]:
        """What the robot's own safety refuses at this moment: BACKUP_LIMIT."""
        return self._hazards

    @property
    def obstacles(self) -> tuple[tuple[Obstacle, Point], ...]:
        """The obstacles that are there now, each with the place of its centre."""
        return tuple((o, self._scene.position(o.name)) for o in self._scene.obstacles)

    @property
    def presences(self) -> tuple[Presence, ...]:
        """Every obstacle since the reset as it came, with the times between which it was there."""
        return tuple(self._inventory.presences)

    @property
    def moved(self) -> frozenset[str]:
        """The names of the obstacles that stand elsewhere than they came, put there by `move_obstacle`."""
        return self._inventory.moved

    def clearance(self) -> float:
        """Return the metres from the hull to the nearest surface: inf in an open world, below 0 inside an obstacle."""
        nearest = self._scene.nearest(self._x, self._y)
        return nearest.distance - self.profile.radius if nearest else math.inf

    def true_ranges(self) -> NDArray[np.float64]:
        """Return the exact range of each lidar beam in m; inf where nothing is in reach, 0 inside an obstacle."""
        return self._scene.cast(self.pose.compose(self.profile.lidar.pose), self.profile.lidar.beams)

    # --------------------------------------------------------------- sensors

    def scan(self) -> ScanReading:
        """Return what the lidar reads now. Asking changes nothing: asked twice, it says the same."""
        return self._lidar.scan(self.true_ranges(), self._tick, self.time)

    def odometry(self) -> OdometryReading:
        """Return where the wheels say the robot is."""
        measured = self._odometry.measured(self._v * SUBSTEP_S, self._omega * SUBSTEP_S, self._tick)
        twist = Twist(measured[0] * SUBSTEPS_PER_S, measured[1] * SUBSTEPS_PER_S)
        return OdometryReading(self.time, Pose(*self._odom), twist)

    def imu(self) -> ImuReading:
        """Return what the IMU reads now."""
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
        """Put an obstacle into the running world and return its name (one is found if it has none)."""
        if not obstacle.name:
            taken = {o.name for o in self._scene.obstacles} | set(self._inventory.waiting)
            obstacle = with_name(obstacle, free_name(type(obstacle).__name__.lower(), taken))
        self._inventory.introduce(obstacle, self.time)
        self._note_contacts(abs(self._v))
        return obstacle.name

    def remove_obstacle(self, name: str) -> None:
        """Take an obstacle away.

        Raises:
            KeyError: there is none of that name.
        """
        self._inventory.withdraw(name, self.time)
        self._touching -= {name}
        self._pressed = None

    def move_obstacle(self, name: str, x: float, y: float) -> None:
        """Put an obstacle elsewhere at once: its centre at x, y (m, map frame), turned as it was.

        It stays the same obstacle: a recording shows one, with its path. What moves by itself begins its way anew from
        there, the way shifted along. The centre is `obstacle.pose`: a wall's middle, a map's lower left corner. If the
        hull is there, that is a contact.

        Raises:
            KeyError: there is none of that name.
            ValueError: x or y is not finite.
        """
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ValueError(f"({x}, {y}) is not finite; give metres in the map frame")
        self._inventory.move(name, x, y, self.time)
        self._note_contacts(abs(self._v))

    def place_robot(self, pose: Pose, *, odometry_notices: bool = True) -> None:
        """Put the robot elsewhere, standing still. With `odometry_notices=False` it is kidnapped: odometry stays.

        Raises:
            ValueError: the pose is not finite.
        """
        if not all(math.isfinite(value) for value in (pose.x, pose.y, pose.yaw)):
            raise ValueError(f"{pose} is not finite; give metres and radians")
        self._x, self._y, self._yaw = pose.x, pose.y, normalize_angle(pose.yaw)
        self._v = self._omega = self._v_before = 0.0
        if odometry_notices:
            self._odom = _flat(self._odom_origin.inverse().compose(self.pose))
        self._free = 0.0
        self._touching = frozenset()
        self._note_contacts(0.0)

    def set_battery(self, percentage: float) -> None:
        """Set the charge, 0 to 1.

        Raises:
            ValueError: it is no number from 0 to 1.
        """
        if not 0.0 <= percentage <= 1.0:
            raise ValueError(f"battery percentage {percentage} is not from 0 to 1")
        self._charge = float(percentage)

    def trigger(self, event: str) -> None:
        """Let an event happen: obstacles that wait for it appear, vanish or begin to move."""
        self._events.append(Event(self.time, "trigger", event))
        self._inventory.hear(event, self.time)
        self._note_contacts(abs(self._v))

    # ---------------------------------------------------------------- inside

    @property
    def _is_driving(self) -> bool:
        return self._v != 0.0 or self._omega != 0.0

    def _start_odometry(self) -> None:
        self._odom_origin = self.pose if self.profile.odometry.starts_at_zero else Pose()
        self._odom = _flat(self._odom_origin.inverse().compose(self.pose))

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
        """Change the speed towards the command, move along an exact arc, stop at what is in the way."""
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
        """Refuse to drive further back than the limit, as a Create 3 does: it has no cliff sensors behind."""
        refused = target.v < 0.0 and self._backed >= limit
        if refused != bool(self._hazards):
            self._hazards = frozenset({"BACKUP_LIMIT"} if refused else ())
            self._events.append(Event(self.time, "hazard" if refused else "hazard over", "BACKUP_LIMIT"))
        return Twist(0.0, target.omega) if refused else target

    def _is_clear(self, x: float, y: float) -> bool:
        """Tell whether the hull may go on to x, y; remember how far it can go from there without asking again."""
        if self._pressed is not None and self._leads_into(self._pressed, x, y):
            return False
        self._pressed = None
        self._free = gap = self._gap(x, y)
        if gap >= PART_M:
            self._touching = frozenset()
        elif self._touching:
            self._touching = self._touching & frozenset(hit.name for hit in self._touched(x, y, PART_M))
        if self._touching:
            self._free = 0.0  # or the end of the contact would be seen late
        # Whoever touches something, or has been put inside an obstacle, may leave.
        return gap >= 0.0 or gap >= self._gap(self._x, self._y)

    def _gap(self, x: float, y: float) -> float:
        """Return the clearance of a hull at x, y, as far as it is below `LOOK_M`."""
        nearest = self._scene.nearest(x, y, self.profile.radius + LOOK_M)
        return nearest.distance - self.profile.radius if nearest else LOOK_M

    def _leads_into(self, pressed: Nearest, x: float, y: float) -> bool:
        """Tell whether the way to x, y leads towards the surface that the standing hull is pressed against."""
        return (x - self._x) * (pressed.point[0] - self._x) + (y - self._y) * (pressed.point[1] - self._y) > 0.0

    def _stop_at_surface(self, x: float, y: float) -> Point:
        """Return the last free place on the way to x, y; record the contact; the wheels stall."""
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
        """Record what touches the hull where it is now, after something was put somewhere."""
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
        """Stop an obstacle at the hull that it would run into, and record the contact."""
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
        """Return the clearance when the mover makes only a part of its last step; leave it there."""
        mover.hold(part)
        self._scene.move(name, mover.x, mover.y)
        return self._gap(self._x, self._y)


class _Due:
    """When a sensor reads next: at the first substep that is not before n / rate, for n = 1, 2, 3 ..."""

    def __init__(self, rate_hz: float, read: Callable[[], Reading]) -> None:
        self.read = read
        self._period = SUBSTEPS_PER_S / rate_hz
        self._count = 1
        self.tick = self._tick_of(1)

    def _tick_of(self, count: int) -> int:
        return math.ceil(count * self._period - 1e-9)

    def falls_on(self, tick: int) -> bool:
        """Tell whether a reading is due at this substep, and if so look ahead to the next."""
        if tick < self.tick:
            return False
        self._count += 1
        self.tick = self._tick_of(self._count)
        return True


def _flat(pose: Pose) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw
