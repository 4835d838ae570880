"""Offer a node's services in its place and forward the calls, so that calls made by others are recorded.

Runs in a thread of its own: a call must not wait for the simulator's next tick.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from typing import Any

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.task import Future

from sim.bridge import NODE_NAME

Note = Callable[[str, Any, Any], None]

_RETRY_S = 1.0  # wall time; a node that runs answers in milliseconds


class ServiceProxy:
    """Forwards the calls of services to the same services under other names.

    A request or its answer can get lost while both sides are still discovering each other. A call without an answer is
    repeated every `_RETRY_S` seconds, without holding up other calls, so the caller waits but is always answered.

    Args:
        services: for each name that is offered, the type and the name to forward to.
        note: called with service, request and answer of each call.
    """

    def __init__(self, domain_id: int, services: Mapping[str, tuple[Any, str]], note: Note) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        self._node = rclpy.create_node(
            NODE_NAME, context=self._context, enable_rosout=False, start_parameter_services=False
        )
        self._group = ReentrantCallbackGroup()
        self._clients = [self._offer(name, *target, note) for name, target in services.items()]
        self._waiting: dict[int, tuple[Client, Any, Future]] = {}
        self._node.create_timer(_RETRY_S, self._retry, callback_group=self._group)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def is_ready(self) -> bool:
        """Return whether every service to forward to has been found."""
        return all(client.service_is_ready() for client in self._clients)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._context.try_shutdown()
        self._thread.join(5.0)

    def _offer(self, name: str, kind: Any, target: str, note: Note) -> Client:
        client = self._node.create_client(kind, target, callback_group=self._group)

        async def forward(request: Any, _response: Any) -> Any:
            answer = await self._call(client, request)
            note(name, request, answer)
            return answer

        self._node.create_service(kind, name, forward, callback_group=self._group)
        return client

    async def _call(self, client: Client, request: Any) -> Any:
        answered = Future()
        self._waiting[id(answered)] = client, request, answered
        try:
            self._send(client, request, answered)
            return await answered
        finally:
            del self._waiting[id(answered)]

    def _retry(self) -> None:
        for client, request, answered in list(self._waiting.values()):
            self._send(client, request, answered)

    @staticmethod
    def _send(client: Client, request: Any, answered: Future) -> None:
        def answer(future: Future) -> None:
            if not answered.done():
                answered.set_result(future.result())

        client.call_async(request).add_done_callback(answer)

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()
