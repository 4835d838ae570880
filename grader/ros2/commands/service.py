"""`ros2 service`: what services there are, and calling one."""

from __future__ import annotations

import argparse
import time

from . import completing, hints, messages
from .answers import Refusal
from .graph import Graph, NamesAndTypes, add_graph_arguments, graph, show_names, spin


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the words and flags."""
    parser.add_argument("--include-hidden-services", action="store_true", help="Consider hidden services as well")
    verbs = parser.add_subparsers(title="Commands", metavar="Call `ros2 service <command> -h` for more detailed usage.")
    listing = verbs.add_parser("list", help="Output a list of available services")
    add_graph_arguments(listing)
    listing.add_argument("-t", "--show-types", action="store_true", help="Additionally show the service type")
    listing.add_argument("-c", "--count-services", action="store_true", help="Only display the number of services")
    listing.add_argument("--include-hidden-services", action="store_true", default=argparse.SUPPRESS)
    listing.set_defaults(run=show_list)
    kind = verbs.add_parser("type", help="Output a service's type")
    add_graph_arguments(kind)
    service_argument(kind)
    kind.set_defaults(run=show_type)
    find = verbs.add_parser("find", help="Output a list of available services of a given type")
    add_graph_arguments(find)
    find.add_argument("service_type", help="Name of the ROS service type to filter for (e.g. 'std_srvs/srv/Trigger')")
    find.add_argument("-c", "--count-services", action="store_true", help="Only display the number of services")
    find.add_argument("--include-hidden-services", action="store_true", default=argparse.SUPPRESS)
    find.set_defaults(run=show_found)
    call = verbs.add_parser("call", help="Call a service")
    service_argument(call)
    completing.add(
        call, "service_type", completing.types("srv", "service_name", Graph.service_type),
        help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')",
    )  # fmt: skip
    messages.add_values(call, "srv", "service_type", "Values to fill the service request with in YAML format")
    call.add_argument("-r", "--rate", metavar="N", type=float, help="Repeat the call at a specific rate in Hz")
    call.set_defaults(run=run_call)


def service_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the name of a service, which the shell completes."""
    complete = completing.from_graph(lambda seen: [name for name, _types in seen.services()])
    completing.add(parser, "service_name", complete, help="Name of the ROS service (e.g. '/add_two_ints')")


def show_list(args: argparse.Namespace) -> int:
    """Print the services."""
    with graph(args.spin_time) as seen:
        seen.settle()
        services = seen.services(args.include_hidden_services)
    return show_names(services, args.show_types, args.count_services)


def show_type(args: argparse.Namespace) -> int:
    """Print the types of a service."""
    with graph(args.spin_time) as seen:
        found = seen.service_type(args.service_name)
    if found is None:
        return 1
    print(found)
    return 0


def show_found(args: argparse.Namespace) -> int:
    """Print the services of a type."""
    with graph(args.spin_time) as seen:
        seen.settle()
        found = [one for one in seen.services(args.include_hidden_services) if args.service_type in one[1]]
    return show_names(found, False, args.count_services)


def run_call(args: argparse.Namespace) -> int:
    """Call a service and print the answer; a service that is not there is waited for, as the real command does."""
    kind = messages.load(args.service_type, "srv")
    values = messages.given(args)
    if args.rate is not None and not args.rate > 0:
        raise Refusal("rate must be greater than zero")
    with graph() as seen:
        client = seen.node.create_client(kind, args.service_name)
        request = kind.Request()
        messages.fill(request, values, seen.node.get_clock().now().to_msg())
        if not client.wait_for_service(0.2):
            print("waiting for service to become available...", flush=True)
            hints.wait(client.service_is_ready, args.service_name, args.service_type, lambda: served(seen))
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
    """Return the services that other nodes offer; what a client of ours asks for is not among them."""
    return [found for one in seen.others() for found in seen.node.get_service_names_and_types_by_node(*one)]
