"""The unseen task of notebook 04, solved: the published edition has it in place of the learner's."""

import math

from ros2_robot_controller.utils.conversions import normalize_angle
from ros2_robot_controller.utils.scans import SECTOR_HALF_WIDTH, Proximity, measure_proximity
from sensor_msgs.msg import LaserScan


def around(scan, mounted):
    """Return the Proximity of a robot whose lidar is turned to the left by `mounted` (rad)."""
    turned = LaserScan(ranges=scan.ranges, range_min=scan.range_min, range_max=scan.range_max)
    turned.angle_min, turned.angle_increment = scan.angle_min + mounted, scan.angle_increment
    near = measure_proximity(turned)
    angles = [turned.angle_min + beam * scan.angle_increment for beam in range(len(scan.ranges))]

    def looks(way):
        return any(abs(normalize_angle(angle - way)) <= SECTOR_HALF_WIDTH for angle in angles)

    return Proximity(near.ahead if looks(0.0) else 0.0, near.behind if looks(math.pi) else 0.0, near.anywhere)
