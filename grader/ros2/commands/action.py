"""`ros2 action`: what actions there are, and sending a goal."""

# mypy: disallow-untyped-calls=False
# rclpy is typed in parts: a call of an untyped function there says nothing about our code.

from __future__ import annotations

import argparse
from typing import Any

from . import completing, hints, messages
from .answers import Refusal
from .graph import Graph, NamesAndTypes, full_name, graph, interrupt_later, show_names, spin, split_name

ANSWER_S = 5.0  # how long an answer is waited for after Ctrl-C


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the words and flags."""
    verbs = parser.add_subparsers(title="Commands", metavar="Call `ros2 action <command> -h` for more detailed usage.")
    listing = verbs.add_parser("list", help="Output a list of action names")
    listing.add_argument("-t", "--show-types", action="store_true", help="Additionally show the action type")
    listing.add_argument("-c", "--count-actions", action="store_true", help="Only display the number of actions")
    listing.set_defaults(run=show_list)
    info = verbs.add_parser("info", help="Print information about an action")
    action_argument(info)
    info.add_argument("-t", "--show-types", action="store_true", help="Additionally show the action types")
    info.add_argument("-c", "--count", action="store_true", help="Only show the number of servers and clients")
    info.set_defaults(run=show_info)
    kind = verbs.add_parser("type", help="Print a action's type")
    action_argument(kind)
    kind.set_defaults(run=show_type)
    send = verbs.add_parser("send_goal", help="Send an action goal")
    action_argument(send)
    completing.add(
        send, "action_type", completing.types("action", "action_name", action_type),
        help="Type of the ROS action (e.g. 'example_interfaces/action/Fibonacci')",
    )  # fmt: skip
    messages.add_values(
        send, "action", "action_type", "Goal request values in YAML format (e.g. '{order: 10}')", "goal"
    )
    send.add_argument("-f", "--feedback", action="store_true", help="Echo feedback messages for the goal")
    send.add_argument("-t", "--timeout", metavar="N", type=float, help="Seconds to wait for the result, then cancel")
    send.set_defaults(run=run_send_goal)


def action_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the name of an action, which the shell completes."""
    complete = completing.from_graph(lambda seen: [name for name, _types in actions(seen)])
    completing.add(parser, "action_name", complete, help="Name of the ROS action (e.g. '/fibonacci')")


def action_type(seen: Graph, name: str) -> str | None:
    """Wait for an action, and return its type."""
    found = seen.wait_for(lambda: dict(actions(seen)).get(full_name(name)))
    return found[0] if found else None


def actions(seen: Graph) -> NamesAndTypes:
    """Return the actions with their types."""
    from rclpy.action.graph import get_action_names_and_types

    return sorted(get_action_names_and_types(seen.node))


def served(seen: Graph) -> NamesAndTypes:
    """Return the actions that nodes serve."""
    from rclpy.action.graph import get_action_server_names_and_types_by_node as served_by

    return [found for one in seen.others() for found in served_by(seen.node, *one)]


def show_list(args: argparse.Namespace) -> int:
    """Print the actions."""
    with graph() as seen:
        seen.settle()
        found = actions(seen)
    return show_names(found, args.show_types, args.count_actions)


def show_type(args: argparse.Namespace) -> int:
    """Print the types of an action."""
    with graph() as seen:
        found = seen.wait_for(lambda: dict(actions(seen)).get(full_name(args.action_name)))
    for one in found or ():
        print(one)
    return 0 if found else 1


def show_info(args: argparse.Namespace) -> int:
    """Print who serves an action and who uses it."""
    from rclpy.action import graph as ends

    name = full_name(args.action_name)
    with graph() as seen:
        seen.wait_for(lambda: dict(actions(seen)).get(name))
        seen.settle()
        print(f"Action: {name}")
        for title, ask in (
            ("clients", ends.get_action_client_names_and_types_by_node),
            ("servers", ends.get_action_server_names_and_types_by_node),
        ):
            found = []
            for node in seen.nodes():
                types = dict(ask(seen.node, *split_name(node))).get(name)
                if types:
                    found.append(f"    {node}" + (f" [{', '.join(types)}]" if args.show_types else ""))
            print(f"Action {title}: {len(found)}")
            if not args.count:
                for line in found:
                    print(line)
    return 0


def run_send_goal(args: argparse.Namespace) -> int:
    """Send a goal and follow it to its end; Ctrl-C cancels it."""
    from rclpy.action.client import ActionClient

    kind = messages.load(args.action_type, "action")
    values = messages.given(args)
    with graph() as seen:
        client = ActionClient(seen.node, kind, args.action_name)
        goal = kind.Goal()
        messages.fill(goal, values, seen.node.get_clock().now().to_msg())

        def feedback(said: Any) -> None:
            print(f"Feedback:\n    {messages.to_yaml(said.feedback)}", flush=True)

        print("Waiting for an action server to become available...", flush=True)
        hints.wait(client.server_is_ready, args.action_name, args.action_type, lambda: served(seen))
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
            if not spin(seen.node, result.done, args.timeout):
                print(f"Timeout of {args.timeout:g} s is over.")
                _cancel(seen, asked.result(), result)
        except KeyboardInterrupt:
            code = 2
            if asked is None:
                return code
            # A goal that has been sent but not answered yet would be driven to, with nobody to cancel it.
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
