"""Make an install tree safe to read, flag what tampers with other programs, and read the interfaces in it.

The submission's code runs during a build, so every installed byte is untrusted. The grader's readers can follow no
link out of the tree, and block on no pipe, because `remove_unsafe_entries` runs first.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

from grader.contract.spec import INTERFACES, INTERFACES_PACKAGE, PACKAGE
from grader.evidence import Flag
from grader.host import ros_env
from grader.sandbox import untrusted
from grader.sanitize import printable

_HARMLESS_GROUPS = ("console_scripts", "gui_scripts")
_PACKAGES = (PACKAGE, INTERFACES_PACKAGE)
_MAX_FLAGS = 20
_MAX_BYTES = 1_000_000


def remove_unsafe_entries(root: Path, inside: str) -> list[Flag]:
    """Leave only folders, regular files and links between them below `root`; return a flag for each entry removed.

    `inside` is the tree's path in the sandbox, where its links were made. Set-user-id bits are cleared, and folders
    made readable.
    """
    flags: list[Flag] = []
    waiting = [root]
    while waiting:
        folder = waiting.pop()
        with contextlib.suppress(OSError):
            folder.chmod(0o755)
        for entry in _entries(folder):
            path = Path(entry.path)
            where = printable(str(path.relative_to(root)))
            if entry.is_symlink():
                if not _stays(path, root, inside):
                    target = printable(str(path.readlink()))
                    flags.append(Flag("link out", f"the build installed a link to {target}", where=where))
                    path.unlink()
            elif entry.is_dir(follow_symlinks=False):
                waiting.append(path)
            elif not entry.is_file(follow_symlinks=False):
                flags.append(Flag("special file", "the build installed a pipe, socket or device", where=where))
                path.unlink()
            else:
                mode = entry.stat(follow_symlinks=False).st_mode
                path.chmod(0o755 if mode & stat.S_IXUSR else 0o644)
    return flags[:_MAX_FLAGS]


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return list(entries)
    except OSError:
        return []


def _stays(link: Path, root: Path, inside: str) -> bool:
    """Return whether a link leads to a path in the tree, by its text alone and by way of no other link."""
    target = str(link.readlink())
    if target == inside or target.startswith(f"{inside}/"):
        place = os.path.normpath(root / os.path.relpath(target, inside))
    elif target.startswith("/"):
        return False
    else:
        place = os.path.normpath(link.parent / target)
    steps = Path(place)
    if not steps.is_relative_to(root):
        return False
    return not any(parent.is_symlink() for parent in [steps, *steps.parents] if parent.is_relative_to(root))


def tampering_flags(install: Path) -> list[Flag]:
    """Return a flag for each thing in an install tree that would change programs other than the package's own."""
    site = install / ros_env.SITE_IN_PREFIX
    return list(_site_flags(site))[:_MAX_FLAGS] if site.is_dir() else []


def _site_flags(site: Path) -> Iterator[Flag]:
    for path in sorted(site.iterdir()):
        name = path.stem if path.is_file() else path.name
        where = f"{ros_env.SITE_IN_PREFIX}/{printable(path.name)}"
        if path.name in ("sitecustomize.py", "usercustomize.py", "sitecustomize", "usercustomize"):
            yield Flag("python start-up", "runs in every Python started with this install tree", where=where)
        elif path.suffix == ".pth":
            yield Flag("python start-up", "a .pth file can run code in every Python", where=where)
        elif path.suffix in (".dist-info", ".egg-info"):
            for group in _entry_point_groups(path / "entry_points.txt"):
                yield Flag("entry point", f"extends other programs by the group {printable(group)}", where=where)
        elif _shadows(name):
            yield Flag("module shadowing", f"hides the module {printable(name)} of Python or ROS", where=where)
        elif name not in _PACKAGES and (path.suffix == ".py" or (path / "__init__.py").is_file()):
            words = "Python beside the package: the coverage and the mutants of its tests (T2, T3) leave it out"
            yield Flag("code elsewhere", words, where=where)


def _entry_point_groups(path: Path) -> list[str]:
    try:
        text = path.read_bytes()[:100_000].decode("utf-8", "replace")
    except OSError:
        return []
    return [
        group for group in re.findall(r"^[ \t]*\[([^\]\n]+)\]", text, re.MULTILINE) if group not in _HARMLESS_GROUPS
    ]


def _shadows(name: str) -> bool:
    site = ros_env.SITE_PACKAGES
    return name in sys.stdlib_module_names or (site / name).is_dir() or (site / f"{name}.py").is_file()


def regular_files(folder: Path) -> Iterator[Path]:
    """Yield the regular files below `folder`, without following links."""
    for here, _, names in os.walk(folder):
        for name in names:
            path = Path(here, name)
            if path.is_file() and not path.is_symlink():
                yield path


def interfaces_package(install: Path) -> str:
    """Return the name of the package in which a build installed the contract's interfaces."""
    split = any(_hash_in(install / "share", INTERFACES_PACKAGE, name) for name in INTERFACES)
    whole = any(_hash_in(install / "share", PACKAGE, name) for name in INTERFACES)
    return INTERFACES_PACKAGE if split and not whole else PACKAGE


def installed_hash(share: Path, interface: str) -> str:
    """Return the RIHS01 hash that rosidl installed beside the interface, "" if there is none."""
    return next((found for name in _PACKAGES if (found := _hash_in(share, name, interface))), "")


def _hash_in(share: Path, package: str, interface: str) -> str:
    described = untrusted.read_json(share / package / f"{interface}.json", _MAX_BYTES)
    entries = described.get("type_hashes") if isinstance(described, dict) else None
    for entry in entries if isinstance(entries, list) else []:
        if isinstance(entry, dict) and entry.get("type_name") == f"{package}/{interface}":
            return str(entry.get("hash_string", ""))[:80]
    return ""


def interface_text(share: Path, interface: str) -> str:
    """Return the installed text of an interface such as "msg/SensorFusionData", "" if there is none."""
    kind, name = interface.split("/")
    for package in _PACKAGES:
        path = share / package / kind / f"{name}.{kind}"
        text = untrusted.read_text(path, _MAX_BYTES, errors="replace", newline=None)
        if text is not None:
            return text
    return ""
