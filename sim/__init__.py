"""A two-dimensional robot simulator for the course and its grader: exact, fast and repeatable. It works without ROS."""

from sim.drive import Driver, Seen, drive
from sim.geometry import Pose, Twist, normalize_angle
from sim.inventory import Event, Presence
from sim.obstacles import Box, Circle, Obstacle, Path, Polygon, Wall, room
from sim.recording import Recorder, Recording
from sim.robot import COURSE, PROFILES, TB4, RobotProfile
from sim.sensors import BatteryReading, ImuReading, OdometryReading, Reading, ScanReading
from sim.simulator import SUBSTEP_S, Contact, Simulator
from sim.tourist import Tourist
from sim.world import World, WorldError, load_world, world_names

__all__ = [
    "COURSE",
    "PROFILES",
    "SUBSTEP_S",
    "TB4",
    "BatteryReading",
    "Box",
    "Circle",
    "Contact",
    "Driver",
    "Event",
    "ImuReading",
    "Obstacle",
    "OdometryReading",
    "Path",
    "Polygon",
    "Pose",
    "Presence",
    "Reading",
    "Recorder",
    "Recording",
    "RobotProfile",
    "ScanReading",
    "Seen",
    "Simulator",
    "Tourist",
    "Twist",
    "Wall",
    "World",
    "WorldError",
    "drive",
    "load_world",
    "normalize_angle",
    "room",
    "world_names",
]
