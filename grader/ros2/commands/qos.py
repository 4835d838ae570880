"""Quality of service: from the command line, and matched to the publishers that are there."""

# mypy: disallow-untyped-calls=False
# rclpy is typed in parts: a call of an untyped function there says nothing about our code.

from __future__ import annotations

import argparse
from typing import Any

PROFILES = ("unknown", "default", "system_default", "sensor_data", "services_default", "parameters", "parameter_events")


def add_qos_arguments(parser: argparse.ArgumentParser, default: str = "") -> None:
    """Declare the flags."""
    said = f" ({default})" if default else ""
    parser.add_argument("--qos-profile", choices=PROFILES, help=f"Quality of service preset profile{said}")
    parser.add_argument("--qos-depth", metavar="N", type=int, default=-1, help="Queue size setting")
    parser.add_argument("--qos-history", choices=("system_default", "keep_last", "keep_all", "unknown"))
    parser.add_argument("--qos-reliability", choices=("system_default", "reliable", "best_effort", "unknown"))
    parser.add_argument("--qos-durability", choices=("system_default", "transient_local", "volatile", "unknown"))


def matching(publishers: list[Any], depth: int = -1) -> Any:
    """Return a profile with which all publishers are heard."""
    flags = {"qos_profile": None, "qos_history": None, "qos_reliability": None, "qos_durability": None}
    return asked(argparse.Namespace(qos_depth=depth, **flags), publishers)


def asked(args: argparse.Namespace, publishers: list[Any] | None = None) -> Any:
    """Return the profile that the flags ask for; what they leave open is chosen so that all publishers are heard."""
    from rclpy import qos

    chosen = args.qos_profile
    presets = {
        "sensor_data": qos.qos_profile_sensor_data,
        "services_default": qos.qos_profile_services_default,
        "parameters": qos.qos_profile_parameters,
        "parameter_events": qos.qos_profile_parameter_events,
        "system_default": qos.qos_profile_system_default,
    }
    base = presets.get(chosen)
    profile = qos.QoSProfile(
        depth=base.depth if base else 10,
        reliability=base.reliability if base else qos.ReliabilityPolicy.RELIABLE,
        durability=base.durability if base else qos.DurabilityPolicy.VOLATILE,
    )
    if chosen is None and publishers:
        if any(end.qos_profile.reliability == qos.ReliabilityPolicy.BEST_EFFORT for end in publishers):
            profile.reliability = qos.ReliabilityPolicy.BEST_EFFORT
        if all(end.qos_profile.durability == qos.DurabilityPolicy.TRANSIENT_LOCAL for end in publishers):
            profile.durability = qos.DurabilityPolicy.TRANSIENT_LOCAL
    if args.qos_depth >= 0:
        profile.depth = args.qos_depth
    if args.qos_history:
        profile.history = qos.HistoryPolicy[args.qos_history.upper()]
    if args.qos_reliability:
        profile.reliability = qos.ReliabilityPolicy[args.qos_reliability.upper()]
    if args.qos_durability:
        profile.durability = qos.DurabilityPolicy[args.qos_durability.upper()]
    return profile
