"""Sensor readings as ROS messages, stamped with ROS time. No rclpy: publishing is the caller's job."""

from __future__ import annotations

import array
import math
from dataclasses import replace
from typing import Any

from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, LaserScan

from sim.geometry import Pose, Twist
from sim.sensors import BatteryReading, ImuReading, OdometryReading, Reading, ScanReading

# ROS time at the simulator's time 0. It is not 0, which rclpy takes for "no clock message has come yet".
START_S = 100


def to_message(reading: Reading, began: float = 0.0) -> LaserScan | Odometry | Imu | BatteryState:
    """Return a sensor reading as the ROS message that the sensor's driver would publish.

    `began` is the time of the run, in s, at which the simulator's own began.
    """
    reading = replace(reading, stamp=reading.stamp + began) if began else reading
    if isinstance(reading, ScanReading):
        return _scan_message(reading)
    if isinstance(reading, OdometryReading):
        return _odometry_message(reading.stamp, reading.pose, reading.twist)
    if isinstance(reading, ImuReading):
        return _imu_message(reading)
    return _battery_message(reading)


def set_stamp(stamp: Any, t: float) -> None:
    """Set a builtin_interfaces/Time to the ROS time of the simulator's time `t` (s)."""
    stamp.sec, stamp.nanosec = divmod(START_S * 1_000_000_000 + round(t * 1e9), 1_000_000_000)


def _scan_message(reading: ScanReading) -> LaserScan:
    message = LaserScan()
    set_stamp(message.header.stamp, reading.stamp)
    message.header.frame_id = "laser"
    message.angle_min = float(reading.angle_min)
    message.angle_increment = float(reading.angle_increment)
    message.angle_max = float(reading.angle_min + reading.angle_increment * max(0, len(reading.ranges) - 1))
    message.range_min = float(reading.range_min)
    message.range_max = float(reading.range_max)
    # array.array is the only type that the setter accepts without checking every element.
    message.ranges = array.array("f", reading.ranges.astype("f4").tobytes())
    return message


def _odometry_message(t: float, pose: Pose, twist: Twist) -> Odometry:
    message = Odometry()
    set_stamp(message.header.stamp, t)
    message.header.frame_id = "odom"
    message.child_frame_id = "base_link"
    message.pose.pose.position.x = float(pose.x)
    message.pose.pose.position.y = float(pose.y)
    message.pose.pose.orientation.z = math.sin(pose.yaw / 2)
    message.pose.pose.orientation.w = math.cos(pose.yaw / 2)
    message.twist.twist.linear.x = float(twist.v)
    message.twist.twist.angular.z = float(twist.omega)
    return message


def _imu_message(reading: ImuReading) -> Imu:
    message = Imu()
    set_stamp(message.header.stamp, reading.stamp)
    message.header.frame_id = "imu_link"
    message.orientation.z = math.sin(reading.yaw / 2)
    message.orientation.w = math.cos(reading.yaw / 2)
    acceleration, velocity = reading.linear_acceleration, reading.angular_velocity
    for vector, values in ((message.linear_acceleration, acceleration), (message.angular_velocity, velocity)):
        vector.x, vector.y, vector.z = (float(value) for value in values)
    return message


def _battery_message(reading: BatteryReading) -> BatteryState:
    message = BatteryState()
    set_stamp(message.header.stamp, reading.stamp)
    message.percentage = float(reading.percentage)
    message.voltage = float(reading.voltage)
    message.current = float(reading.current)
    message.charge = message.capacity = message.design_capacity = message.temperature = math.nan
    message.present = True
    return message


def no_float(value: float) -> str:
    """Return in words what a number of a message is if it was no float when its node assigned it, else "".

    rclpy does not convert: it reads the memory of an int as if it held a float. What is there is far below any speed.
    """
    if value != value:
        return "nan: a division by zero, or a negative int where a float is needed (write -1.0, not -1)"
    if 0.0 < abs(value) < _SMALLEST:
        return f"{value:.0e}: an int where a float is needed (write 1.0, not 1)"
    return ""


_SMALLEST = 1e-300
