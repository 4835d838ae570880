"""How a command ends early: with one message and an exit code."""

from __future__ import annotations


class Refusal(Exception):
    """What was asked cannot be answered; the message goes to stderr."""

    def __init__(self, message: str, code: int = 1) -> None:
        super().__init__(message)
        self.code = code
