"""Quality-of-service profiles: from the flags of a command, and matched to the publishers of a topic."""

# mypy: disallow-untyped-calls=False
# rclpy is only partly typed, so calling its untyped functions is allowed here.

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

PROFILES = ("unknown", "default", "system_default", "sensor_data", "services_default", "parameters", "parameter_events")


def qos_arguments(parser: argparse.ArgumentParser, default: str = "") -> None:
    """Declare the flags."""
    note = f" ({default})" if default else ""
    parser.add_argument("--qos-profile", choices=PROFILES, help=f"Quality of service preset profile{note}")
    parser.add_argument("--qos-depth", metavar="N", type=int, default=-1, help="Queue size setting")
    parser.add_argument("--qos-history", choices=("system_default", "keep_last", "keep_all", "unknown"))
    parser.add_argument("--qos-reliability", choices=("system_default", "reliable", "best_effort", "unknown"))
    parser.add_argument("--qos-durability", choices=("system_default", "transient_local", "volatile", "unknown"))


def matching(offered: Sequence[Any], depth: int = 10) -> Any:
    """Return a profile that is compatible with every offered one, of rclpy or rosbags; reliable if there is none."""
    from rclpy import qos

    best_effort = any(one.reliability.name == "BEST_EFFORT" for one in offered)
    local = bool(offered) and all(one.durability.name == "TRANSIENT_LOCAL" for one in offered)
    return qos.QoSProfile(
        depth=depth,
        reliability=qos.ReliabilityPolicy.BEST_EFFORT if best_effort else qos.ReliabilityPolicy.RELIABLE,
        durability=qos.DurabilityPolicy.TRANSIENT_LOCAL if local else qos.DurabilityPolicy.VOLATILE,
    )


def from_flags(args: argparse.Namespace, offered: Sequence[Any] = ()) -> Any:
    """Return the profile that the flags ask for; without a preset it starts from one that matches the offered ones."""
    from rclpy import qos

    presets = {
        "sensor_data": qos.qos_profile_sensor_data,
        "services_default": qos.qos_profile_services_default,
        "parameters": qos.qos_profile_parameters,
        "parameter_events": qos.qos_profile_parameter_events,
        "system_default": qos.qos_profile_system_default,
    }
    profile = matching(() if args.qos_profile else offered)
    if (preset := presets.get(args.qos_profile)) is not None:
        profile = qos.QoSProfile(depth=preset.depth, reliability=preset.reliability, durability=preset.durability)
    if args.qos_depth >= 0:
        profile.depth = args.qos_depth
    if args.qos_history:
        profile.history = qos.HistoryPolicy[args.qos_history.upper()]
    if args.qos_reliability:
        profile.reliability = qos.ReliabilityPolicy[args.qos_reliability.upper()]
    if args.qos_durability:
        profile.durability = qos.DurabilityPolicy[args.qos_durability.upper()]
    return profile
