"""`ros2 action`: list the actions, and send a goal."""

# mypy: disallow-untyped-calls=False
# rclpy is only partly typed, so calling its untyped functions is allowed here.

from __future__ import annotations

import argparse
from typing import Any

from . import Refusal, arguments, messages
from .graph import Graph, NamesAndTypes, full_name, graph, interrupt_later, spin, split_name, wait

ANSWER_S = 5.0  # how long to wait for an answer after Ctrl-C


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "action")
    list_ = add_verb("list", "Output a list of action names", arguments.show_list)
    arguments.list_arguments(list_, "action")
    info = add_verb("info", "Print information about an action", show_info)
    arguments.name_argument(info, "action")
    send = add_verb("send_goal", "Send an action goal", run_send_goal)
    arguments.name_argument(send, "action")
    send.add_argument("action_type", help="Type of the ROS action (e.g. 'example_interfaces/action/Fibonacci')")
    text = "Goal request values in YAML format (e.g. '{order: 10}')"
    send.add_argument("values", metavar="goal", nargs="?", default="", help=text)
    send.add_argument("-f", "--feedback", action="store_true", help="Echo feedback messages for the goal")


def served(seen: Graph) -> NamesAndTypes:
    """Return the actions that nodes serve."""
    from rclpy.action.graph import get_action_server_names_and_types_by_node as served_by

    return [found for one in seen.others() for found in served_by(seen.node, *one)]


def show_info(args: argparse.Namespace) -> None:
    """Print who serves an action and who uses it."""
    from rclpy.action import graph as ends

    name = full_name(args.action_name)
    with graph() as seen:
        seen.types("action", name)  # waits for it
        seen.settle()
        print(f"Action: {name}")
        for title, ask in (
            ("clients", ends.get_action_client_names_and_types_by_node),
            ("servers", ends.get_action_server_names_and_types_by_node),
        ):
            found = [node for node in seen.nodes() if name in dict(ask(seen.node, *split_name(node)))]
            print("\n    ".join([f"Action {title}: {len(found)}", *found]))


def run_send_goal(args: argparse.Namespace) -> int:
    """Send a goal and follow it to its end; Ctrl-C cancels it."""
    from rclpy.action.client import ActionClient

    kind = messages.load(args.action_type, "action")
    values = messages.from_yaml(args.values)
    with graph() as seen:
        client = ActionClient(seen.node, kind, args.action_name)
        goal = kind.Goal()
        messages.fill(goal, values, seen.node.get_clock().now().to_msg())

        def feedback(said: Any) -> None:
            print(f"Feedback:\n    {messages.to_yaml(said.feedback)}", flush=True)

        print("Waiting for an action server to become available...", flush=True)
        wait(client.server_is_ready, args.action_name, args.action_type, lambda: served(seen))
        print(f"Sending goal:\n     {messages.to_yaml(goal)}", flush=True)
        code, asked = 0, None
        try:
            with interrupt_later():
                asked = client.send_goal_async(goal, feedback if args.feedback else None)
            spin(seen.node, asked.done)
            if (result := _accepted(asked)) is None:
                print("Goal was rejected.")
                return 0  # as with the real command
            print(f"Goal accepted with ID: {bytes(asked.result().goal_id.uuid).hex()}\n", flush=True)
            spin(seen.node, result.done)
        except KeyboardInterrupt:
            code = 2
            if asked is None:
                return code
            # The robot would drive to a goal that has been sent but not answered yet, with no client left to cancel it.
            spin(seen.node, asked.done, ANSWER_S)
            if (result := _accepted(asked)) is None:
                return code
            _cancel(seen, asked.result(), result)
        _show(result)
        client.destroy()
    return code


def _accepted(asked: Any) -> Any | None:
    """Return a future of the goal's result if it has been accepted."""
    handle = asked.result() if asked.done() else None
    return None if handle is None or not handle.accepted else handle.get_result_async()


def _show(result: Any) -> None:
    from action_msgs.msg import GoalStatus

    answer = result.result() if result.done() else None
    if answer is None:
        raise Refusal(f"Exception while getting result: {result.exception()!r}")
    names = {getattr(GoalStatus, n): n.removeprefix("STATUS_") for n in dir(GoalStatus) if n[:7] == "STATUS_"}
    print(f"Result:\n    {messages.to_yaml(answer.result)}")
    print(f"Goal finished with status: {names.get(answer.status, answer.status)}")


def _cancel(seen: Graph, handle: Any, result: Any) -> None:
    print("Canceling goal...", flush=True)
    cancelled = handle.cancel_goal_async()
    spin(seen.node, cancelled.done, ANSWER_S)
    answer = cancelled.result()
    if answer is not None and answer.goals_canceling:
        print("Goal canceled.", flush=True)
    spin(seen.node, result.done, ANSWER_S)
