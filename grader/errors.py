"""The two families of errors. Which family an error belongs to decides who pays for it."""

EXIT_GRADED, EXIT_NOT_GRADED, EXIT_USAGE, EXIT_OUR_FAULT = 0, 1, 2, 3
"""What a verb returns to the shell: graded, could not be graded, wrong usage, the kit's or the host's fault."""


class KitError(Exception):
    """An expected error. Its message says what happened, to what, and what to do next."""


class SubmissionError(KitError):
    """The submission cannot be graded as it is; the student can mend it."""


class GraderError(KitError):
    """The kit or its host failed; no submission loses points by it."""
