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
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.task import Future

Note = Callable[[str, Any, Any], None]

_AGAIN_S = 1.0  # wall time; a node that runs answers in milliseconds


class Relay:
    """Passes calls of each service on to another name; `note` is told service, request, answer.

    `services` maps the name that is offered to its type and the name behind.

    A request or its answer may get lost while the two sides are still finding each other. A call without an answer is
    made again every `_AGAIN_S` seconds, and other calls go on meanwhile: the caller waits, it is never let down.
    """

    def __init__(self, domain_id: int, services: Mapping[str, tuple[Any, str]], note: Note) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        name = f"relay_{random.SystemRandom().getrandbits(48):012x}"
        self._node = rclpy.create_node(name, context=self._context, enable_rosout=False)
        self._group = ReentrantCallbackGroup()
        self._clients = [self._offer(name, *behind, note) for name, behind in services.items()]
        self._waiting: dict[int, tuple[Client, Any, Future]] = {}
        self._node.create_timer(_AGAIN_S, self._call_again, callback_group=self._group)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def is_ready(self) -> bool:
        """Has every service that calls are passed on to been found?"""
        return all(client.service_is_ready() for client in self._clients)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._context.try_shutdown()
        self._thread.join(5.0)

    def _offer(self, name: str, kind: Any, behind: str, note: Note) -> Client:
        client = self._node.create_client(kind, behind, callback_group=self._group)

        async def pass_on(request: Any, _response: Any) -> Any:
            answer = await self._call(client, request)
            note(name, request, answer)
            return answer

        self._node.create_service(kind, name, pass_on, callback_group=self._group)
        return client

    async def _call(self, client: Client, request: Any) -> Any:
        answered = Future()
        self._waiting[id(answered)] = client, request, answered
        try:
            self._ask(client, request, answered)
            return await answered
        finally:
            del self._waiting[id(answered)]

    def _call_again(self) -> None:
        for client, request, answered in list(self._waiting.values()):
            self._ask(client, request, answered)

    @staticmethod
    def _ask(client: Client, request: Any, answered: Future) -> None:
        def answer(future: Future) -> None:
            if not answered.done():
                answered.set_result(future.result())

        client.call_async(request).add_done_callback(answer)

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()
