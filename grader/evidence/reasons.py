"""Why something did not happen: a trial that ended early, a call without an answer, a check that was not judged.

A reason is data: whoever acts on one reads its fields. Its words are for people, and are made here alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from grader.evidence.quality import Fault
from grader.words import mark, say


class Kind(Enum):
    """What kind of reason it is."""

    # How a trial ended before its script did.
    NO_PROGRAM = "no program"
    NO_FILE = "no file"
    DIED_EARLY = "died early"
    NOT_UP = "not up"
    DIED = "died"
    HANGS = "hangs"
    SLOW = "slow"
    WAITS = "waits"
    WAITED = "waited"
    OBSERVER_CRASHED = "observer crashed"
    # Why a call or a goal has no answer.
    NO_SERVICE = "no service"
    NO_ACTION = "no action"
    NO_ANSWER = "no answer"
    NO_VERDICT = "no verdict"
    # Why a check was not judged, or failed, apart from these.
    NOT_BUILT = "not built"
    UNHEARD = "unheard"
    UNWRITTEN = "unwritten"
    NO_RESPONSE = "no response"
    UNTRIED = "untried"
    DEPENDS = "depends"


WORDS = {
    Kind.NO_PROGRAM: mark("there is no executable {name} in lib/{package}"),
    Kind.NO_FILE: mark("there is no {name} in share/{package}"),
    Kind.DIED_EARLY: mark("{starter} ended before {started} came up, with exit status {exit_code}"),
    Kind.NOT_UP: mark("no node {name} came up{within}; the graph shows {graph}"),
    Kind.DIED: mark("the node ended at {seconds:.2f} s with exit status {exit_code}"),
    Kind.HANGS: mark("the node did not answer for {seconds:g} s: a callback hangs{at}"),
    Kind.SLOW: mark("the trial took more than {seconds:g} s of wall time"),
    Kind.WAITS: mark(
        "the node waited {seconds:g} s longer than a robot would have taken: a callback sleeps, or waits{at}"
    ),
    Kind.WAITED: mark(
        "the trial was not run: in those before it the node had waited {seconds:g} s longer than a robot would have "
        "taken, because a callback sleeps, or waits"
    ),
    Kind.OBSERVER_CRASHED: mark("the process that observes the node crashed on what it was sent, twice in a row"),
    Kind.NO_SERVICE: mark("there is no service {name} of the contract's type"),
    Kind.NO_ACTION: mark("there is no action {name} of the contract's type"),
    Kind.NO_ANSWER: mark("no answer within {seconds:g} s"),
    Kind.NO_VERDICT: mark("the goal was neither accepted nor rejected within {seconds:g} s"),
    Kind.NOT_BUILT: mark("`colcon build` {said}{see}"),
    Kind.UNHEARD: mark(
        "{said}: subscribed reliably, and the sensors here publish best effort, as many drivers do, so nothing "
        "arrives. Subscribe with qos_profile_sensor_data{see}"
    ),
    Kind.UNWRITTEN: mark("there is no {name} in share/{package}; {name} is not in the package"),
    Kind.NO_RESPONSE: mark("{said}: `return response`?"),
    Kind.UNTRIED: mark("not tried yet: {said}{see}"),
    Kind.DEPENDS: mark("{said}{see}"),
}
"""Each kind in words, with the reason's fields and some made of them."""


@dataclass(frozen=True)
class Reason:
    """Why something did not happen.

    Attributes:
        name: the node, executable, file, service or action that it is about.
        package: the package that lacks it.
        launch: the launch file that was to start the node, "" without one.
        exit_code: of the node.
        seconds: when it happened, or how long was waited for it; 0.0 if that does not matter.
        place: where in the package, "driver.py:88, in `f`"; "" if that is not known.
        nodes: what the graph showed instead of the node.
        requirements: the ids of those that come first.
        fault: what the package's text shows to be behind it.
        said: what a check says of it.
    """

    kind: Kind
    name: str = ""
    package: str = ""
    launch: str = ""
    exit_code: int | None = None
    seconds: float = 0.0
    place: str = ""
    nodes: tuple[str, ...] = ()
    requirements: tuple[str, ...] = ()
    fault: Fault | None = None
    said: str = ""

    def __str__(self) -> str:
        """Return the reason as the beginning of a sentence."""
        return say(
            WORDS[self.kind],
            **{**vars(self), "said": say(self.said)},
            starter=self.launch or say("the node"),
            started=say("a node") if self.launch else say("it"),
            within=say(" within {s:g} s", s=self.seconds) if self.seconds else "",
            graph=", ".join(self.nodes) or say("no node at all"),
            at=say(" at {place}", place=self.place) if self.place else "",
            see=f" ({', '.join(self.requirements)})" if self.requirements else "",
        )
