"""Calls made by others are forwarded and recorded, even if the first request is lost."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool

from grader.trials.service_proxy import ServiceProxy

pytestmark = pytest.mark.ros

DOMAIN = 60 + os.getpid() % 40


@pytest.fixture
def graph() -> Iterator[tuple[Node, SingleThreadedExecutor]]:
    """A node in a context of its own, and its executor."""
    context = Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = rclpy.create_node("caller", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    yield node, executor
    executor.shutdown()
    context.try_shutdown()


def spin_until(executor: SingleThreadedExecutor, done: Any, seconds: float = 30.0) -> bool:
    end = time.monotonic() + seconds
    while not done() and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.05)
    return bool(done())


def offer(node: Node, name: str) -> None:
    def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = request.data
        return response

    node.create_service(SetBool, name, answer)


def test_a_call_made_before_the_node_is_discovered_is_answered_afterwards(graph):
    """DDS drops a request without a listener; two gradings in a row lost the demonstration's points that way."""
    node, executor = graph
    seen: list[tuple[str, bool, bool]] = []
    noted = threading.Event()

    def note(name: str, request: Any, answer: Any) -> None:
        seen.append((name, request.data, answer.success))
        noted.set()

    proxy = ServiceProxy(DOMAIN, {"switch": (SetBool, "behind/switch")}, note)
    try:
        assert not proxy.is_ready()
        client = node.create_client(SetBool, "switch")
        assert spin_until(executor, client.service_is_ready)
        first, second = (client.call_async(SetBool.Request(data=data)) for data in (True, False))
        assert not spin_until(executor, first.done, seconds=0.3)
        offer(node, "behind/switch")
        assert spin_until(executor, lambda: first.done() and second.done())
        assert (first.result().success, second.result().success) == (True, False)
        assert proxy.is_ready()
        assert sorted(seen) == [("switch", False, False), ("switch", True, True)]
    finally:
        proxy.close()
