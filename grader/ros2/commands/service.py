"""`ros2 service`: list the services, and call one."""

from __future__ import annotations

import argparse
import time

from . import arguments, messages
from .graph import Graph, NamesAndTypes, graph, show_names, show_types, wait
from .refusals import Refusal
from .spinning import spin


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    parser.add_argument("--include-hidden-services", action="store_true", help="Consider hidden services as well")
    add_verb = arguments.verbs(parser, "service")
    listing = add_verb("list", "Output a list of available services", show_list, graph=True)
    arguments.list_arguments(listing, "service", hidden=True)
    arguments.service_argument(add_verb("type", "Output a service's type", show_type, graph=True))
    find = add_verb("find", "Output a list of available services of a given type", show_found, graph=True)
    find.add_argument("service_type", help="Name of the ROS service type to filter for (e.g. 'std_srvs/srv/Trigger')")
    arguments.list_arguments(find, "service", types=False, hidden=True)
    call = add_verb("call", "Call a service", run_call)
    arguments.service_argument(call)
    arguments.type_argument(call, "service_type", "srv", "Type of the ROS service (e.g. 'std_srvs/srv/Empty')")
    arguments.values_arguments(call, "srv", "service_type", "Values to fill the service request with in YAML format")
    call.add_argument("-r", "--rate", metavar="N", type=float, help="Repeat the call at a specific rate in Hz")


def show_list(args: argparse.Namespace) -> int:
    """Print the services."""
    with graph(args.spin_time) as seen:
        seen.settle()
        services = seen.services(args.include_hidden_services)
    return show_names(services, args.show_types, args.count)


def show_type(args: argparse.Namespace) -> int:
    """Print the types of a service."""
    with graph(args.spin_time) as seen:
        return show_types(seen.service_types(args.service_name))


def show_found(args: argparse.Namespace) -> int:
    """Print the services of a type."""
    with graph(args.spin_time) as seen:
        seen.settle()
        found = [one for one in seen.services(args.include_hidden_services) if args.service_type in one[1]]
    return show_names(found, False, args.count)


def run_call(args: argparse.Namespace) -> int:
    """Call a service and print the answer; like the real command, wait for a service that does not exist yet."""
    kind = messages.load(args.service_type, "srv")
    values = arguments.given_values(args)
    if args.rate is not None and not args.rate > 0:
        raise Refusal("rate must be greater than zero")
    with graph() as seen:
        client = seen.node.create_client(kind, args.service_name)
        request = kind.Request()
        messages.fill(request, values, seen.node.get_clock().now().to_msg())
        if not client.wait_for_service(0.2):
            print("waiting for service to become available...", flush=True)
            wait(client.service_is_ready, args.service_name, args.service_type, lambda: served(seen))
        while True:
            print(f"requester: making request: {request!r}\n", flush=True)
            begin = time.monotonic()
            future = client.call_async(request)
            spin(seen.node, future.done)
            if future.exception() is not None:
                raise Refusal(f"Exception while calling service: {future.exception()!r}")
            print(f"response:\n{future.result()!r}\n", flush=True)
            if args.rate is None:
                return 0
            time.sleep(max(0.0, begin + 1 / args.rate - time.monotonic()))


def served(seen: Graph) -> NamesAndTypes:
    """Return the services that other nodes offer; those that only a client of ours asks for are left out."""
    return [found for one in seen.others() for found in seen.node.get_service_names_and_types_by_node(*one)]
