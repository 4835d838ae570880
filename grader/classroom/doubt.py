"""What a person should look at before a class is graded: whose a submission is, which one counts, what is not known."""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass
from enum import Enum

from grader.classroom.roster import Person


class DoubtKind(Enum):
    """What is doubtful."""

    LAYOUT = "the layout of the export"
    MOST_UNMATCHED = "most submissions match nobody"
    UNMATCHED = "matches nobody of the roster"
    AMBIGUOUS = "could be of several people"
    SEVERAL = "several hand-ins of the same people"
    NO_TIME = "no time of submission"
    UNLINKED = "no account on the platform"
    GROUPS = "named after groups"
    LEFT_OUT = "cannot be graded"
    LOST = "handed in, and not among the submissions"
    UNREADABLE = "cannot be read"


@dataclass(frozen=True)
class Doubt:
    """One doubt about a class.

    Attributes:
        kind: what is doubtful.
        label: the submission, person or file as the export or the roster calls it.
        what: a sentence that says what was found.
        todo: a sentence that says what to do.
        entry: the id of the submission in the class, "" if the doubt is not about one.
        people: the people of the roster whom it may concern: until it is decided, none of them handed in nothing.
        anyone: it may concern everyone who has no submission.
        stops: nothing should be graded before a person has looked at it.
    """

    kind: DoubtKind
    label: str
    what: str
    todo: str
    entry: str = ""
    people: tuple[Person, ...] = ()
    stops: bool = False
    anyone: bool = False

    @property
    def text(self) -> str:
        """Return the doubt and what to do as one line."""
        return f"{self.what} {self.todo}".strip()


def too_many(unmatched: Sized, entries: Sized) -> bool:
    """Return whether so many of the submissions match nobody that the roster is hardly that of the class."""
    return 2 * len(unmatched) > len(entries)
