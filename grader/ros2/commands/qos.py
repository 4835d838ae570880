"""Quality-of-service profiles: from the flags of a command, and matched to the publishers of a topic."""

# mypy: disallow-untyped-calls=False
# rclpy is only partly typed, so calling its untyped functions is allowed here.

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any


def qos_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags."""
    parser.add_argument("--qos-depth", metavar="N", type=int, default=10, help="Queue size setting")
    parser.add_argument("--qos-reliability", choices=("reliable", "best_effort"))
    parser.add_argument("--qos-durability", choices=("transient_local", "volatile"))


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
    """Return the profile that the flags ask for; what they leave open matches the offered ones."""
    from rclpy import qos

    profile = matching(offered, args.qos_depth)
    if args.qos_reliability:
        profile.reliability = qos.ReliabilityPolicy[args.qos_reliability.upper()]
    if args.qos_durability:
        profile.durability = qos.DurabilityPolicy[args.qos_durability.upper()]
    return profile
