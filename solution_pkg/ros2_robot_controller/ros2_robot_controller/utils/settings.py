"""Declare parameters that refuse values which make no sense."""

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

MAX_RATE_HZ = 1000.0  # a Python node that tries to go faster does nothing else


@dataclass(frozen=True)
class Setting:
    """A parameter: its default, and what its values must be, as a test and in words."""

    default: Any
    is_sensible: Callable[[Any], bool]
    must_be: str


def at_least_zero(default: float) -> Setting:
    """Return a setting for a size that may be zero: a distance, a speed limit."""
    return Setting(default, lambda value: 0.0 <= value < math.inf, 'finite and not negative')


def above_zero(default: float) -> Setting:
    """Return a setting for a size that must not be zero: an acceleration."""
    return Setting(default, lambda value: 0.0 < value < math.inf, 'finite and above 0')


def rate(default: float) -> Setting:
    """Return a setting for a rate in Hz."""
    return Setting(default, lambda value: 0.0 < value <= MAX_RATE_HZ,
                   f'above 0 and at most {MAX_RATE_HZ:g} Hz')


def percentage(default: float) -> Setting:
    """Return a setting for a share in percent."""
    return Setting(default, lambda value: 0.0 <= value <= 100.0, 'from 0 to 100')


def name(default: str) -> Setting:
    """Return a setting for a name."""
    return Setting(default, lambda value: bool(value.strip()), 'a text that is not empty')


def first_refusal(settings: dict[str, Setting], parameters: list[Parameter]) -> str:
    """Return why these values are not accepted, empty if they are; others' parameters pass."""
    for parameter in parameters:
        setting = settings.get(parameter.name)
        if setting is not None and not setting.is_sensible(parameter.value):
            return f'{parameter.name} must be {setting.must_be}, not {parameter.value}'
    return ''


def declare(node: Node, settings: dict[str, Setting]) -> None:
    """
    Declare the parameters on the node, and refuse senseless values from then on.

    Raises rclpy's InvalidParameterValueException, or InvalidParameterTypeException, where the
    YAML file or the command line gives such a value.
    """
    def check(parameters: list[Parameter]) -> SetParametersResult:
        reason = first_refusal(settings, parameters)
        return SetParametersResult(successful=not reason, reason=reason)

    # The check comes first: registered after the declarations it would never see the values of
    # the YAML file and the command line.
    node.add_on_set_parameters_callback(check)
    for parameter, setting in settings.items():
        node.declare_parameter(parameter, setting.default)
