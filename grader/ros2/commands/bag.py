"""`ros2 bag`: record topics to an MCAP file and play them back, byte for byte, with the package `rosbags`."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from . import Refusal, arguments, messages, packages
from .graph import Graph, full_name, graph, interrupt_later, matching, spin, steady_clock
from .interface import nested

LOOK_S = 0.1  # how often to look for new topics


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "bag")
    record = add_verb("record", "Record ROS data to a bag", run_record)
    record.add_argument("topics", metavar="topic", nargs="*", help="Topics to be recorded")
    record.add_argument("-a", "--all", "--all-topics", action="store_true", help="Record all topics")
    record.add_argument("-o", "--output", help="Destination of the bag folder; a name with the time by default")
    play = add_verb("play", "Play back ROS data from a bag", run_play)
    play.add_argument("bag_path", type=Path, help="Bag to open")
    play.add_argument("-r", "--rate", type=arguments.positive, default=1.0, help="Playback rate (default: 1)")
    play.add_argument("--topics", nargs="+", default=[], help="Topics to replay, separated by space")
    play.add_argument("-m", "--remap", nargs="+", default=[], help="Topics to remap, as old:=new")
    info = add_verb("info", "Print information about a bag to the screen", run_info)
    info.add_argument("bag_path", type=Path, help="Bag to open")


def say(who: str, text: str) -> None:
    """Print in the form in which a node of the real command logs."""
    print(f"[INFO] [{time.time():.9f}] [{who}]: {text}", file=sys.stderr, flush=True)


def message_text(kind: str) -> str:
    """Return a message's definition with those of all messages in it, in the form of MCAP files."""
    package, _, name = kind.split("/")
    parts = [packages.definition(package, "msg", name).read_text()]
    waiting, seen = [(package, parts[0])], {(package, name)}
    while waiting:
        home, text = waiting.pop(0)
        for line in text.splitlines():
            code = line.split("#", 1)[0].strip()
            inner = nested(home, code) if code else None
            if inner and inner not in seen:
                seen.add(inner)
                found = packages.definition(inner[0], "msg", inner[1]).read_text()
                parts.append(f"{'=' * 80}\nMSG: {inner[0]}/{inner[1]}\n{found}")
                waiting.append((inner[0], found))
    return "\n".join(parts)


def look(seen: Graph, writer: Any, waiting: set[str] | None, done: set[str]) -> None:
    """Record the topics that have appeared, of those `waiting` (None: of all), and add their names to those `done`."""
    for name, types in seen.names("topic"):
        publishers = seen.node.get_publishers_info_by_topic(name)
        if name in done or (waiting is not None and name not in waiting) or not publishers:
            continue
        done.add(name)
        try:
            _subscribe(seen.node, writer, name, types[0], publishers)
        except Refusal as refusal:
            said = f"Topic '{name}' has unknown type '{types[0]}'. Only topics with known types are recorded: "
            say("rosbag2_recorder", said + str(refusal))


def _subscribe(node: Any, writer: Any, name: str, type_name: str, publishers: list[Any]) -> None:
    kind, offered = messages.load(type_name, "msg"), [end.qos_profile for end in publishers]
    connection = writer.add_connection(
        name,
        type_name,
        msgdef=message_text(type_name),
        rihs01=messages.hash_text(publishers[0]),
        offered_qos_profiles=[_offered(profile) for profile in offered],
    )

    def take(raw: bytes) -> None:
        writer.write(connection, node.get_clock().now().nanoseconds, raw)

    node.create_subscription(kind, name, take, matching(offered, depth=1000), raw=True)
    say("rosbag2_recorder", f"Subscribed to topic '{name}'")


def _offered(profile: Any) -> Any:
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

    def time_of(duration: Any) -> Any:
        return QosTime(duration.nanoseconds // 10**9, duration.nanoseconds % 10**9)

    # The graph does not say which history another node's endpoint keeps.
    return Qos(
        QosHistory.KEEP_LAST,
        max(profile.depth, 1),
        QosReliability[profile.reliability.name],
        QosDurability[profile.durability.name],
        time_of(profile.deadline),
        time_of(profile.lifespan),
        QosLiveliness[profile.liveliness.name],
        time_of(profile.liveliness_lease_duration),
        profile.avoid_ros_namespace_conventions,
    )


def run_record(args: argparse.Namespace) -> None:
    """Record until Ctrl-C."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    names = set(map(full_name, args.topics))
    if not names and not args.all:
        raise Refusal("Need to specify at least one option out of all, all-topics or topics")
    folder = Path(args.output or time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S"))
    if folder.exists():
        raise Refusal(f"[ERROR] [ros2bag]: Output folder '{folder}' already exists.")
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a recording that is terminated must still be closed
    # Whenever Ctrl-C comes, the messages recorded so far become a bag.
    with (
        contextlib.suppress(KeyboardInterrupt),
        Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer,
        contextlib.suppress(KeyboardInterrupt),
        graph() as seen,
    ):
        again = partial(look, seen, writer, None if args.all else names, set())
        say("rosbag2_recorder", "Listening for topics...")
        with interrupt_later():
            again()
        seen.node.create_timer(LOOK_S, again, clock=steady_clock())
        say("rosbag2_recorder", "Recording...")
        spin(seen.node, lambda: False)
    # The writer puts its own name where the distribution belongs.
    metadata = folder / "metadata.yaml"
    if metadata.is_file():  # else Ctrl-C came before there was a bag
        metadata.write_text(
            metadata.read_text().replace("ros_distro: rosbags", f"ros_distro: {os.environ['ROS_DISTRO']}")
        )
    say("rosbag2_recorder", "Recording stopped")


@contextlib.contextmanager
def _opened(path: Path) -> Any:
    from rosbags.rosbag2 import Reader, ReaderError

    folder = path.parent if path.suffix in (".mcap", ".db3") and (path.parent / "metadata.yaml").is_file() else path
    if not folder.exists():
        raise Refusal(f"[ERROR] [ros2bag]: Bag path '{path}' does not exist!")
    try:
        with Reader(folder) as reader:
            yield reader
    except (FileNotFoundError, ReaderError) as error:
        why = "it has no metadata.yaml, so it is not a bag, or its recording was cut short"
        said = error if isinstance(error, ReaderError) else why
        raise Refusal(f"[ERROR] [ros2bag]: Could not read bag '{path}': {said}") from error


def run_info(args: argparse.Namespace) -> None:
    """Print a summary of a bag."""
    with _opened(args.bag_path) as bag:
        folder = args.bag_path if args.bag_path.is_dir() else args.bag_path.parent
        metadata = yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
        files = metadata["relative_file_paths"]
        number = sum((folder / file).stat().st_size for file in files)
        size = f"{number / 1024:.1f} KiB" if number < 1024**2 else f"{number / 1024**2:.1f} MiB"
        empty = bag.message_count == 0
        start, end = (0, 0) if empty else (bag.start_time, bag.end_time)
        print(f"\nFiles:             {' '.join(files)}")
        print(f"Bag size:          {size}")
        print(f"Storage id:        {metadata['storage_identifier']}")
        print(f"ROS Distro:        {metadata.get('ros_distro') or 'unknown'}")
        print(f"Duration:          {(end - start) / 1e9:.9f}s")
        print(f"Start:             {_date(start)}")
        print(f"End:               {_date(end)}")
        print(f"Messages:          {bag.message_count}")
        title = "Topic information: "
        for connection in bag.connections:
            print(
                f"{title}Topic: {connection.topic} | Type: {connection.msgtype} | Count: {connection.msgcount} "
                f"| Serialization Format: {connection.ext.serialization_format}"
            )
            title = " " * len(title)
        print("Service:           0\nService information: ")


def _date(stamp_ns: int) -> str:
    whole = time.strftime("%b %e %Y %H:%M:%S", time.localtime(stamp_ns // 10**9))
    return f"{whole}.{stamp_ns % 10**9:09d} ({stamp_ns // 10**9}.{stamp_ns % 10**9:09d})"


def run_play(args: argparse.Namespace) -> None:
    """Publish the recorded messages at the pace of the recording."""
    new_names = dict(rule.split(":=", 1) for rule in args.remap if ":=" in rule)
    only = set(map(full_name, args.topics))
    with _opened(args.bag_path) as bag, graph() as seen:
        publishers: dict[int, Any] = {}
        chosen = [c for c in bag.connections if not only or c.topic in only]
        for connection in chosen:
            try:
                kind = messages.load(connection.msgtype, "msg")
            except Refusal as refusal:
                say("rosbag2_player", f"Ignoring topic '{connection.topic}': {refusal}")
                continue
            name = new_names.get(connection.topic, connection.topic)
            profile = matching(connection.ext.offered_qos_profiles)
            publishers[connection.id] = seen.node.create_publisher(kind, name, profile)
        # Subscribers have to find the publishers before the first message is gone.
        seen.wait_for(lambda: all(p.get_subscription_count() for p in publishers.values()), 1.0)
        say("rosbag2_player", f"Set rate to {args.rate:g}")
        _play(bag, [c for c in chosen if c.id in publishers], publishers, args.rate)
        time.sleep(0.1)


def _play(bag: Any, chosen: list[Any], publishers: dict[int, Any], rate: float) -> None:
    if not chosen or bag.message_count == 0:
        return
    first, begin = bag.start_time, time.monotonic()
    for connection, stamp_ns, raw in bag.messages(connections=chosen):
        due = begin + (stamp_ns - first) / 1e9 / rate
        time.sleep(max(0.0, due - time.monotonic()))
        publishers[connection.id].publish(bytes(raw))
