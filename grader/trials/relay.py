"""Offer a node's services in its place and pass the calls on, so that calls by others are seen.

In a thread of its own: a call shall not wait for the simulator's next tick.
"""

from __future__ import annotations

import contextlib
import random
import threading
from collections.abc import Callable, Mapping
from typing import Any

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

from grader.trials.types import SERVICES

Note = Callable[[str, Any, Any], None]


class Relay:
    """Passes calls of each service on to the name it stands for in `names`; `note` is told service, request, answer."""

    def __init__(self, domain_id: int, names: Mapping[str, str], note: Note) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        name = f"relay_{random.SystemRandom().getrandbits(48):012x}"
        self._node = rclpy.create_node(name, context=self._context, enable_rosout=False)
        for service, behind in names.items():
            self._offer(service, behind, note)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._context.try_shutdown()
        self._thread.join(5.0)

    def _offer(self, service: str, behind: str, note: Note) -> None:
        # While the service waits for the answer, its own group of callbacks takes nothing else.
        client = self._node.create_client(SERVICES[service], behind, callback_group=ReentrantCallbackGroup())

        async def pass_on(request: Any, _response: Any) -> Any:
            answer = await client.call_async(request)
            note(service, request, answer)
            return answer

        self._node.create_service(SERVICES[service], service, pass_on)

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()
