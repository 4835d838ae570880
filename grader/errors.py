"""The two families of errors. Which family an error belongs to decides who pays for it."""


class KitError(Exception):
    """An expected error. Its message says what happened, to what, and what to do next."""


class SubmissionError(KitError):
    """The submission cannot be graded as it is; the student can mend it."""


class GraderError(KitError):
    """The kit or its host failed; no submission loses points by it."""
