"""A trial's stage for a notebook: the same lockstep, calls and goals, but messages and a recording can be looked at.

Can be imported once interface_types.load has made the contract's types importable.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from grader.course import Course
from grader.evidence import Kind, Reason
from grader.trials.messages import fill, interface
from grader.trials.node_under_test import NodeUnderTest, Program, TrialOver, has_one_thread
from grader.trials.plan import TrialPlan
from grader.trials.stage import Stage
from grader.words import say
from sim import Recorder, Simulator
from sim.bridge import TICK_S
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
        launch: str,
        domain_id: int,
        recorder: Recorder,
        messages: Mapping[str, list[tuple[float, Any]]],
        package: Path,
    ) -> None:
        plan = TrialPlan(
            "notebook", "", lambda _stage: None, node, simulator.world.name, (),
            launch=launch, awaits=tuple(course.nodes) if launch else (),
        )  # fmt: skip
        watched = NodeUnderTest(
            course, plan, simulator, process, domain_id,
            one_thread=has_one_thread(package), reliable=False, work_limit_s=math.inf,
        )  # fmt: skip
        super().__init__(course, plan, simulator.seed, simulator, watched)
        self._shown, self._readings = recorder, list[Reading]()
        self._commanded = messages.get(self.bridge.topics.command, [])
        self.bridge.on_command, self.bridge.on_published = self._take_command, self._take_published
        for topic, type_ in self.contract.publishes.items():
            if topic != self.bridge.topics.command:
                self.bridge.subscribe(interface(type_), topic, partial(self._note, messages[topic]))

    def _tick(self, dt: float = TICK_S) -> None:
        super()._tick(dt)
        self._shown.take(self._readings)
        self._readings.clear()

    def ask(self, service: str, fields: Mapping[str, object]) -> tuple[Any, str]:
        """Return a service's response, or None and the reason."""
        client = self.node.services.get(service)
        if client is None or not self.node.found(service, client.service_is_ready):
            return None, say("no node offers {service}", service=service)
        future = client.call_async(fill(self.node.service_types[service].Request(), dict(fields)))
        self._await(future.done)
        if not future.done():
            client.remove_pending_request(future)
            return None, say("{service} gave no answer", service=service)
        self.bridge.settle()
        return future.result(), ""

    def deaf_to(self) -> str:
        """Return in words which sensors the node receives nothing of, "" if there are none."""
        topics = self.node.deaf_to()
        return str(Reason(Kind.UNHEARD, said=", ".join(topics))) if topics else ""

    @property
    def takes_goals(self) -> bool:
        """Return whether the node offers the action."""
        return self.node.action is not None and bool(self.node.action.server_is_ready())

    def _note(self, messages: list[tuple[float, Any]], message: Any) -> None:
        messages.append((self.t, message))

    def _take_command(self, t: float, message: Any) -> None:
        self.recorder.take_command(t, message)
        self._commanded.append((t, message))

    def _take_published(self, reading: Reading) -> None:
        self.recorder.take_published(reading)
        self._readings.append(reading)
