"""The unseen task of notebook 05, solved: the published edition has it in place of the learner's."""

import math


def safe_speed(distance, base):
    """Return the highest speed (m/s) from which the base stops before its hull touches."""
    if not distance > base.radius:  # also for NaN
        return 0.0
    lost = base.brake * base.delay
    return min(base.max_speed, math.sqrt(lost**2 + 2 * base.brake * (distance - base.radius)) - lost)
