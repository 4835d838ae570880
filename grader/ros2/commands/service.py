"""`ros2 service`: list and describe the services, and call one."""

from __future__ import annotations

import argparse

from . import Refusal, arguments, messages
from .graph import Graph, NamesAndTypes, graph, spin, wait


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "service")
    list_ = add_verb("list", "Output a list of available services", arguments.show_list, graph=True)
    arguments.list_arguments(list_, "service")
    arguments.name_argument(add_verb("type", "Output a service's type", show_type, graph=True), "service")
    find = add_verb("find", "Output a list of available services of a given type", show_found, graph=True)
    find.add_argument("service_type", help="Name of the ROS service type to filter for (e.g. 'std_srvs/srv/Trigger')")
    find.set_defaults(kind="service")
    call = add_verb("call", "Call a service", run_call)
    arguments.name_argument(call, "service")
    call.add_argument("service_type", help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')")
    call.add_argument("values", nargs="?", default="", help="Values to fill the service request with in YAML format")


def show_type(args: argparse.Namespace) -> int:
    """Print the types of a service; return 1 if there is no such service."""
    with graph(args.spin_time) as seen:
        types = seen.types("service", args.service_name)
    for one in types:
        print(one)
    return 0 if types else 1


def show_found(args: argparse.Namespace) -> None:
    """Print the services that have a type."""
    for name, types in arguments.settled(args):
        if args.service_type in types:
            print(name)


def run_call(args: argparse.Namespace) -> None:
    """Call a service and print the answer; like the real command, wait for a service that does not exist yet."""
    kind = messages.load(args.service_type, "srv")
    values = messages.from_yaml(args.values)
    with graph() as seen:
        client = seen.node.create_client(kind, args.service_name)
        request = kind.Request()
        messages.fill(request, values, seen.node.get_clock().now().to_msg())
        if not client.wait_for_service(0.2):
            print("waiting for service to become available...", flush=True)
            wait(client.service_is_ready, args.service_name, args.service_type, lambda: served(seen))
        print(f"requester: making request: {request!r}\n", flush=True)
        future = client.call_async(request)
        spin(seen.node, future.done)
        if future.exception() is not None:
            raise Refusal(f"Exception while calling service: {future.exception()!r}")
        print(f"response:\n{future.result()!r}\n", flush=True)


def served(seen: Graph) -> NamesAndTypes:
    """Return the services that other nodes offer; those that only a client of ours asks for are left out."""
    return [found for one in seen.others() for found in seen.node.get_service_names_and_types_by_node(*one)]
