"""Find how near things are in a laser scan. Pure geometry: no node, no decisions."""

from collections.abc import Iterator
from dataclasses import dataclass
import math

from ros2_robot_controller.utils.conversions import normalize_angle
from sensor_msgs.msg import LaserScan

SECTOR_HALF_WIDTH = math.radians(60.0)  # what lies in the way: 60 degrees to each side


@dataclass(frozen=True)
class Proximity:
    """The closest valid reading, in metres, in each direction that matters; inf for none."""

    ahead: float = math.inf
    behind: float = math.inf
    anywhere: float = math.inf


def valid_readings(scan: LaserScan) -> Iterator[tuple[float, float]]:
    """
    Yield (angle, distance) of each beam that measured something, in radians and metres.

    NaN, infinity, zero and what lies outside [range_min, range_max] measured nothing (REP 117).
    """
    for beam, distance in enumerate(scan.ranges):
        # NaN compares False: ask "is it good?", never "is it bad?".
        in_range = scan.range_min <= distance <= scan.range_max
        if in_range and 0.0 < distance < math.inf:
            yield scan.angle_min + beam * scan.angle_increment, distance


def closest_reading(scan: LaserScan) -> float:
    """Return the closest valid reading of the whole scan in metres, inf where there is none."""
    return min((distance for _, distance in valid_readings(scan)), default=math.inf)


def measure_proximity(scan: LaserScan) -> Proximity:
    """
    Return how near things are ahead, behind and anywhere.

    Beams are sorted by their angle, not by their index: scans start where their driver likes.
    """
    ahead, behind = [], []
    for angle, distance in valid_readings(scan):
        if abs(normalize_angle(angle)) <= SECTOR_HALF_WIDTH:
            ahead.append(distance)
        elif abs(normalize_angle(angle - math.pi)) <= SECTOR_HALF_WIDTH:
            behind.append(distance)
    return Proximity(
        ahead=min(ahead, default=math.inf),
        behind=min(behind, default=math.inf),
        anywhere=closest_reading(scan),
    )
