"""Try the student's code in the kernel: `mine` imports a module as it is saved now, `bench` puts a node on a bench."""

from __future__ import annotations

import importlib
import inspect
import os
from functools import partial
from typing import Any

from grader.host import ros_env
from grader.notebook import interface_types, prerequisites
from grader.notebook.tables import MissingError
from grader.notebook.workspace import NOTEBOOK, course
from grader.words import say

_TICK_S = 0.05
_SPINS = 5  # of the executor: two timers, a goal, and the messages that these cause


class Missing:
    """Stands for a module or node that cannot be had: every use of it raises a MissingError that says why."""

    def __init__(self, why: str) -> None:
        self._why = why

    def __getattr__(self, name: str) -> Any:
        raise MissingError(self._why)


def mine(module: str) -> Any:
    """Return a module of your package ("utils.motion") as it is saved now.

    Where it cannot be imported, say why; each use of it then fails with the same words.
    """
    name = f"{course().package}.{module}"
    try:
        return interface_types.provided(partial(importlib.import_module, name))
    except Exception as error:  # whatever the student's text raises while it is imported
        why = say("{module} cannot be imported: {error}", module=module, error=error)
        if isinstance(error, ModuleNotFoundError):
            lacking = error.name if f"{error.name}".startswith(f"{course().package}.") else name
            path = f"{lacking}".replace(".", "/")
            why += "; " + prerequisites.how_to_get(f"{path}.py", os.environ.get(NOTEBOOK, ""))
        print(say("not yet: {why}", why=why))
        return Missing(why)


def bench(name: str, **parameters: object) -> Any:
    """Return a node of your package ("driver.Driver") on a bench: you set its clock, and read what it commands.

    It is a Bench, and has the node's own attributes and methods too. A bench before it is closed.
    """
    module, _, kind = name.rpartition(".")
    found = mine(module)
    if isinstance(found, Missing):
        return found
    try:
        return Bench(getattr(found, kind), parameters)
    except Exception as error:  # of the student's __init__
        why = say("{kind}() raised {name}: {error}", kind=kind, name=type(error).__name__, error=error)
        if isinstance(error, AttributeError) and not hasattr(error.obj, "_Node__node"):
            why += say(". Does its __init__ begin with super().__init__(...)?")
        print(say("not yet: {why}", why=why))
        return Missing(why)


class Bench:
    """A node whose clock stands until you advance it, and whose cmd_vel is written down. Nobody else hears it.

    Each method returns the commands that it has caused, as a list of (v in m/s, omega in rad/s).
    """

    _current: Bench | None = None

    def __init__(self, node_class: Any, parameters: dict[str, object]) -> None:
        import rclpy
        from rclpy.context import Context
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.parameter import Parameter

        if Bench._current is not None:
            Bench._current.close()
        self._context = Context()
        # What a context is made with stays with it: nothing on a bench is heard elsewhere, not even on another one.
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "OFF"
        rclpy.init(context=self._context)
        os.environ |= ros_env.ON_THIS_MACHINE
        Bench._current = self
        overrides = [Parameter("use_sim_time", value=True)]
        overrides += [Parameter(key, value=value) for key, value in parameters.items()]
        self._commands: list[tuple[float, float]] = []
        self._now_ns = 0
        self._executor = SingleThreadedExecutor(context=self._context)
        try:
            # No log over the network: nobody listens, and two benches would have one logger.
            self.node = node_class(
                context=self._context,
                parameter_overrides=overrides,
                start_parameter_services=False,
                enable_rosout=False,
            )
        except BaseException:
            self.close()
            raise
        self._executor.add_node(self.node)
        commanded = {node.command for node in course().nodes.values()}
        for publisher in self.node.publishers:
            if publisher.topic_name.lstrip("/") in commanded:
                publisher.publish = self._note
        self.set_clock(0.0)

    def __getattr__(self, name: str) -> Any:
        if name == "node":  # __init__ has not made it
            raise AttributeError(say("there is no node on this bench"))
        return getattr(self.node, name)

    def _note(self, twist: Any) -> None:
        self._commands.append((round(twist.linear.x, 6), round(twist.angular.z, 6)))

    def set_clock(self, seconds: float) -> None:
        """Set the node's clock; nothing that is due is run."""
        from rclpy.time import Time

        self._now_ns = round(seconds * 1e9)
        self.node.get_clock().set_ros_time_override(Time(nanoseconds=self._now_ns))

    def commands_of(self, method: Any, *values: object) -> list[tuple[float, float]]:
        """Call a method of the node; return the commands that it causes."""
        before = len(self._commands)
        method(*values)
        return self._commands[before:]

    def advance(self, seconds: float) -> list[tuple[float, float]]:
        """Let time pass in steps of 0.05 s, and run the timers that are due."""
        before = len(self._commands)
        for _ in range(round(seconds / _TICK_S)):
            self.set_clock(self._now_ns / 1e9 + _TICK_S)
            for _ in range(_SPINS):
                self._executor.spin_once(timeout_sec=0.0)
        return self._commands[before:]

    def hear(self, topic: str, message: Any, age: float = 0.0) -> list[tuple[float, float]]:
        """Give the node a message on a topic that it subscribes, measured `age` seconds ago."""
        found = [s for s in self.node.subscriptions if s.topic_name == f"/{topic}"]
        if not found:
            raise LookupError(say("the node does not subscribe to {topic}", topic=topic))
        stamp = message.header.stamp
        stamp.sec, stamp.nanosec = divmod(self._now_ns - round(age * 1e9), 10**9)
        return self.commands_of(found[0].callback, message)

    def ask(self, service: str, **fields: object) -> Any:
        """Return what a service of the node answers."""
        found = [s for s in self.node.services if s.service_name == f"/{service}"]
        if not found:
            raise LookupError(say("the node offers no service {service}", service=service))
        answer = found[0].callback(found[0].srv_type.Request(**fields), found[0].srv_type.Response())
        if answer is None:
            raise TypeError(say("the callback of {service} returned None; `return response`?", service=service))
        return answer

    def begin(self, method: Any, *values: object) -> Any:
        """Start an async method of the node; return its future. It goes on in `advance` when it need not wait."""

        async def run() -> Any:
            result = method(*values)
            return await result if inspect.isawaitable(result) else result

        task = self._executor.create_task(run)
        for _ in range(_SPINS):
            self._executor.spin_once(timeout_sec=0.0)
        return task

    def close(self) -> None:
        """Take the node off the bench."""
        from rclpy.utilities import try_shutdown

        if Bench._current is self:
            Bench._current = None
        self._executor.shutdown()
        if "node" in vars(self):
            self.node.destroy_node()
        try_shutdown(context=self._context)
