"""The function of notebook 00, solved: the published edition has it in place of the learner's."""


def route():
    """Return the way into the office: (v, omega, seconds) for each piece."""
    return [
        (0.25, 0.0, 4.0),  # one metre ahead
        (0.0, 0.785, 2.0),  # a quarter turn to the left
        (0.25, 0.0, 5.6),  # through the door
    ]
