"""Why something did not happen: a trial that ended early, a call without an answer, a check that was not judged.

A reason is data: whoever acts on one reads its fields. Its words are for people, and are made here alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from grader.evidence.quality import Fault
from grader.words import mark, say


class Kind(Enum):
    """What kind of reason it is: its name in the evidence, and its `words`, with a reason's fields and some more."""

    words: str

    def __new__(cls, value: str, words: str) -> Kind:
        """Return a kind with its words, which are no part of its value."""
        self = object.__new__(cls)
        self._value_, self.words = value, words
        return self

    # How a trial ended before its script did.
    NO_PROGRAM = "no program", mark("there is no executable {name} in lib/{package}")
    NO_FILE = "no file", mark("there is no {name} in share/{package}{see}")
    DIED_EARLY = "died early", mark("{starter} ended before {started} came up, with exit status {exit_code}")
    NOT_UP = "not up", mark("no node {name} came up{within}; the graph shows {graph}")
    DIED = "died", mark("the node ended at {seconds:.2f} s with exit status {exit_code}")
    HANGS = "hangs", mark("the node did not answer for {seconds:g} s: a callback hangs{at}")
    SLOW = "slow", mark("the trial took more than {seconds:g} s of wall time")
    WAITS = (
        "waits",
        mark("the node waited {seconds:g} s longer than a robot would have taken: a callback sleeps, or waits{at}"),
    )
    WAITED = (
        "waited",
        mark(
            "the trial was not run: in those before it the node had waited {seconds:g} s longer than a robot would "
            "have taken, because a callback sleeps, or waits"
        ),
    )
    OBSERVER_CRASHED = (
        "observer crashed",
        mark("the process that observes the node crashed on what it was sent, twice in a row"),
    )
    # Why a call or a goal has no answer.
    NO_SERVICE = "no service", mark("there is no service {name} of the contract's type")
    NO_ACTION = "no action", mark("there is no action {name} of the contract's type")
    NO_ANSWER = "no answer", mark("no answer within {seconds:g} s")
    NO_VERDICT = "no verdict", mark("the goal was neither accepted nor rejected within {seconds:g} s")
    # Why a check was not judged, or failed, apart from these.
    NOT_BUILT = "not built", mark("`colcon build` {said}{see}")
    UNHEARD = (
        "unheard",
        mark(
            "{said}: subscribed reliably, and the sensors here publish best effort, as many drivers do, so nothing "
            "arrives. Subscribe with qos_profile_sensor_data{see}"
        ),
    )
    UNWRITTEN = "unwritten", mark("there is no {name} in share/{package}; {name} is not in the package")
    NO_RESPONSE = "no response", mark("{said}: `return response`?")
    NO_MODULES = "no modules", mark("none of the assignment's modules is there: {said}")
    RAISED = "raised", mark("{said}{at}")
    ON_GRAPH = "on graph", mark("{said}{see}")
    INACTIVE = "inactive", mark("{name} is a LifecycleNode that nothing has activated, so it publishes nothing")
    SPINS = "spins", mark("{said}{at}: it takes the node from the executor that runs it, so nothing answers any more")
    NO_FLOAT = (
        "no float",
        mark("{name} has an int where a float is needed, and rclpy does not convert: write 1.0, not 1"),
    )
    UNTRIED = "untried", mark("not tried yet: {said}{see}")
    DEPENDS = "depends", mark("{said}{see}")


_A_TIMER = mark("return at once and let a timer do the next step; where an answer is needed, `await` the future")
_CURES = {
    **dict.fromkeys((Kind.HANGS, Kind.NO_ANSWER, Kind.NO_VERDICT, Kind.SLOW, Kind.WAITS, Kind.WAITED), _A_TIMER),
    Kind.RAISED: mark(
        "correct this first: the node runs on after an exception in the callback of an action, or in a thread of its "
        "own, and what should have followed never happens"
    ),
    Kind.ON_GRAPH: mark("create it with the contract's name and type: nodes of another type never hear each other"),
    Kind.INACTIVE: mark(
        "inherit from rclpy.node.Node; or call trigger_configure() and trigger_activate() before the node spins"
    ),
    Kind.SPINS: mark("make the callback `async def` and `await` the future: the node is being spun already"),
    Kind.NO_FLOAT: mark("float(value), or 1.0 instead of 1, wherever a field of the message is set"),
    Kind.NO_MODULES: mark("these points are for the assignment's nodes: start with one of these modules"),
    Kind.NO_RESPONSE: mark("a service's callback must return the response that it was given"),
}
_AT_A_PLACE = (Kind.NO_ANSWER, Kind.NO_VERDICT, Kind.SLOW, Kind.WAITED)  # without one, something else may be behind it
# By what Python or rclpy says, of exceptions whose own words do not tell what to do.
_CURES_BY_WORDS = {
    "no running event loop": mark(
        "asyncio has no event loop in rclpy's executor: `await` a Future of rclpy.task, and let a timer set its result"
    ),
    "can't be used in 'await' expression": mark(
        "`await` a Future, such as that of call_async(), or a coroutine; anything else is there at once"
    ),
    "'NoneType' object has no attribute 'successful'": mark(
        "the parameter callback has to return a SetParametersResult on every path, also at its end"
    ),
    "generator already executing": mark(
        "a callback must not spin its own executor: make it `async def` and `await` the future"
    ),
}


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
        said: what a check says of it, or what a node raised.
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
            self.kind.words,
            **{**vars(self), "said": say(self.said)},
            starter=self.launch or say("the node"),
            started=say("a node") if self.launch else say("it"),
            within=say(" within {s:g} s", s=self.seconds) if self.seconds else "",
            graph=", ".join(self.nodes) or say("no node at all"),
            at=say(" at {place}", place=self.place) if self.place else "",
            see=f" ({', '.join(self.requirements)})" if self.requirements else "",
        )

    @property
    def cure(self) -> str:
        """Return what to do about it, "" if that depends on more than the reason."""
        if self.fault is not None:
            return self.fault.cure
        by_words = next((cure for words, cure in _CURES_BY_WORDS.items() if words in self.said), "")
        if by_words and self.kind in (Kind.RAISED, Kind.DIED, Kind.DIED_EARLY, Kind.NOT_UP):
            return say(by_words)
        guessed = self.kind in _AT_A_PLACE and not self.place
        return "" if guessed else say(_CURES.get(self.kind, ""))
