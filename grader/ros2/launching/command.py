"""`ros2 launch`: find a launch file, read the arguments to it, and run it or show what it declares."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import modules
from .actions import OTHER_FORMATS, AnyLaunchDescriptionSource, IncludeLaunchDescription, read
from .entities import LaunchDescription, describe
from .errors import LaunchError, explain
from .service import LaunchService
from .substitutions import find_prefix


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare arguments and flags."""
    parser.add_argument("-s", "--show-args", "--show-arguments", action="store_true", help="Show the file's arguments")
    text = "Write how each process started and ended to FILE, as JSON lines"
    parser.add_argument("--record", metavar="FILE", type=Path, help=text)
    text = "Name of the package, or path of the launch file"
    parser.add_argument("package_name", help=text)
    parser.add_argument("launch_file_name", nargs="?", help="Name of the launch file")
    text = "Arguments to the launch file; '<name>:=<value>' (last one wins)"
    parser.add_argument("launch_arguments", nargs="*", help=text)
    parser.set_defaults(run=main)


def main(args: argparse.Namespace) -> int:
    """Run `ros2 launch` and return the exit code."""
    modules.install()
    try:
        path, words = find(args.package_name, args.launch_file_name, args.launch_arguments)
        given = parse(words)
        if args.show_args:
            print(arguments_shown(read(path)))
            return 0
    except Exception as error:
        print(explain(error), file=sys.stderr)
        return 1
    service = LaunchService(record=args.record)
    include = IncludeLaunchDescription(AnyLaunchDescriptionSource(str(path)), launch_arguments=list(given.items()))
    include.place = None  # no line of a launch file
    service.include_launch_description(LaunchDescription([include]))
    return service.run()


def find(package: str, file: str | None, words: list[str]) -> tuple[Path, list[str]]:
    """Return the launch file and the words that are arguments to it.

    Args:
        package: the name of a package, or the path of a launch file.
        file: the name of the launch file, or an argument if `package` is a path.
        words: the words after these.
    """
    if Path(package).is_file():
        return Path(package).absolute(), ([file] if file is not None else []) + words
    if file is None:
        raise LaunchError(
            f"'{package}' is not a file: ros2 launch takes a package and the name of its launch file, or a path"
        )
    try:
        share = find_prefix(package) / "share" / package
    except LaunchError as error:
        raise LaunchError(f"Package '{package}' not found: {error}") from error
    found = sorted(path for path in share.rglob(file) if path.is_file())
    if not found:
        endings = (".py", *OTHER_FORMATS)
        there = ", ".join(path.name for path in sorted(share.rglob("*launch*")) if path.suffix in endings)
        has = f"; it holds {there}" if there else ""
        raise LaunchError(
            f"file '{file}' was not found in the share directory of package '{package}' which is at '{share}'{has}"
        )
    if len(found) > 1:
        raise LaunchError(
            f"file '{file}' was found more than once in the share directory of package '{package}': "
            f"{[str(path) for path in found]}"
        )
    return found[0], words


def parse(words: list[str]) -> dict[str, str]:
    """Return the arguments; of several with the same name the last wins."""
    found: dict[str, str] = {}
    for word in words:
        name, separator, value = word.partition(":=")
        if not separator or not name or not value:
            raise LaunchError(f"malformed launch argument '{word}', expected format '<name>:=<value>'")
        found[name] = value
    return found


def arguments_shown(description: LaunchDescription) -> str:
    """Return the text that `--show-args` prints."""
    lines = ["Arguments (pass arguments as '<name>:=<value>'):"]
    seen: dict[str, bool] = {}
    for argument, conditional in description.declared_arguments():
        if argument.name in seen:
            continue
        seen[argument.name] = conditional
        lines += ["", f"    '{argument.name}':{'*' if conditional else ''}", f"        {argument.description}"]
        if argument.default_value is not None:
            lines.append(f"        (default: {describe(argument.default_value)})")
    if not seen:
        lines += ["", "  No arguments."]
    if any(seen.values()):
        lines += ["", "* argument(s) which are only used if specific conditions occur"]
    return "\n".join(lines)
