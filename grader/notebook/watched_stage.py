"""A trial's stage for a notebook: the same lockstep, calls and goals, but messages and a recording can be looked at.

Can be imported once interface_types.load has made the contract's types importable.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from grader.course import Course
from grader.evidence import Kind, Reason
from grader.trials.interfaces import interface
from grader.trials.messages import fill
from grader.trials.observation import Program, TrialOver, has_one_thread
from grader.trials.plan import TrialPlan
from grader.trials.stage import Stage
from grader.words import say
from sim import Recorder, Simulator
from sim.sensors import Reading

__all__ = ["TrialOver", "WatchedStage"]


class WatchedStage(Stage):
    """A node of `package` and its robot. Adds (t, message) to `messages` by topic, and every reading to `recorder`."""

    def __init__(
        self,
        course: Course,
        node: str,
        simulator: Simulator,
        process: Program,
        *,
        domain_id: int,
        remappings: Mapping[str, str],
        recorder: Recorder,
        messages: Mapping[str, list[tuple[float, Any]]],
        package: Path,
    ) -> None:
        plan = TrialPlan(
            "notebook", "", lambda _stage: None, node, simulator.world.name, (), remappings=dict(remappings)
        )
        super().__init__(course, plan, simulator.seed, simulator, process, domain_id, reliable=False)
        self._work_limit_s = math.inf
        self.has_one_thread = has_one_thread(package)
        self._recorder = recorder
        self._readings: list[Reading] = []
        self._recorded = messages
        for topic, type_ in self.contract.publishes.items():
            if topic != self.bridge.topics.command:
                self._record(interface(type_), topic)

    def tick(self) -> None:
        """Let one tick of simulated time pass.

        Raises:
            TrialOver: the node has ended.
        """
        self._tick()

    def ask(self, service: str, fields: Mapping[str, object]) -> tuple[Any, str]:
        """Return a service's response, or None and the reason."""
        client = self._clients.get(service)
        if client is None or not self._found(service, client.service_is_ready):
            return None, say("no node offers {service}", service=service)
        future = client.call_async(fill(self._service_types[service].Request(), dict(fields)))
        self._await(future.done)
        if not future.done():
            client.remove_pending_request(future)
            return None, say("{service} gave no answer", service=service)
        self.bridge.settle()
        return future.result(), ""

    def deaf_to(self) -> str:
        """Return in words which sensors the node receives nothing of, "" if there are none."""
        topics = self._deaf_to()
        return str(Reason(Kind.UNHEARD, said=", ".join(topics))) if topics else ""

    @property
    def takes_goals(self) -> bool:
        """Return whether the node offers the action."""
        return self.action is not None and bool(self.action.server_is_ready())

    def _record(self, kind: Any, topic: str) -> None:
        def take(message: Any) -> None:
            self._recorded[topic].append((self.t, message))

        self.bridge.subscribe(kind, topic, take)

    def _take_command(self, t: float, message: Any) -> None:
        super()._take_command(t, message)
        self._recorded[self.bridge.topics.command].append((t, message))

    def _take_published(self, reading: Reading) -> None:
        super()._take_published(reading)
        self._readings.append(reading)

    def _sample(self) -> None:
        super()._sample()
        self._recorder.take(self._readings)
        self._readings.clear()
