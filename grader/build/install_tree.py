"""What a build has installed: drop what leads out of the install tree, name what tampers, read the interfaces.

A build is the submission's code, and so is every byte that it installs. Readers on our side follow no link out of the
tree and wait for no pipe because `tidy` has been here first.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import stat
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from grader.contract.spec import INTERFACES, INTERFACES_PACKAGE, PACKAGE
from grader.evidence import Flag
from grader.host import ros_env
from grader.sanitize import printable

_HARMLESS_GROUPS = ("console_scripts", "gui_scripts")


_MOST = 20


_OWN = (PACKAGE, INTERFACES_PACKAGE)


def tidy(root: Path, inside: str) -> list[Flag]:
    """Leave nothing below `root` but folders, plain files and links among them; return what was taken away.

    `inside` is the place of the tree behind the wall, where its links were made.
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
    return flags[:_MOST]


def suspicious(install: Path) -> list[Flag]:
    """Return what in an install tree would change programs other than the package's own."""
    site = install / ros_env.SITE_IN_PREFIX
    return list(_in_site(site))[:_MOST] if site.is_dir() else []


def _in_site(site: Path) -> Iterator[Flag]:
    for path in sorted(site.iterdir()):
        name = path.stem if path.is_file() else path.name
        where = f"{ros_env.SITE_IN_PREFIX}/{printable(path.name)}"
        if path.name in ("sitecustomize.py", "usercustomize.py", "sitecustomize", "usercustomize"):
            yield Flag("python start-up", "runs in every Python that is started with the install tree", where=where)
        elif path.suffix == ".pth":
            yield Flag("python start-up", "a .pth file can run code in every Python", where=where)
        elif path.suffix in (".dist-info", ".egg-info"):
            for group in _groups(path / "entry_points.txt"):
                yield Flag("entry point", f"extends other programs by the group {printable(group)}", where=where)
        elif _importable_elsewhere(name):
            yield Flag("module shadowing", f"stands before the module {printable(name)} of Python or ROS", where=where)
        elif name not in _OWN and (path.suffix == ".py" or (path / "__init__.py").is_file()):
            words = "Python beside the package: the coverage and the faults of its tests (T2, T3) leave it out"
            yield Flag("code elsewhere", words, where=where)


def _groups(path: Path) -> list[str]:
    try:
        text = path.read_bytes()[:100_000].decode("utf-8", "replace")
    except OSError:
        return []
    return [
        group for group in re.findall(r"^[ \t]*\[([^\]\n]+)\]", text, re.MULTILINE) if group not in _HARMLESS_GROUPS
    ]


def _importable_elsewhere(name: str) -> bool:
    ours = ros_env.SITE_PACKAGES
    return name in sys.stdlib_module_names or (ours / name).is_dir() or (ours / f"{name}.py").is_file()


def _stays(link: Path, root: Path, inside: str) -> bool:
    """Return whether a link leads to something in the tree, by its text alone and over no other link."""
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


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return list(entries)
    except OSError:
        return []


_JSON_CAP = 1_000_000


def types_package(install: Path) -> str:
    """Return the package under whose name a build has the contract's interfaces."""
    split = any(_hash_in(install / "share", INTERFACES_PACKAGE, name) for name in INTERFACES)
    whole = any(_hash_in(install / "share", PACKAGE, name) for name in INTERFACES)
    return INTERFACES_PACKAGE if split and not whole else PACKAGE


def regular_files(folder: Path) -> Iterator[Path]:
    """Yield the regular files below `folder`, links not followed."""
    for here, _, names in os.walk(folder):
        for name in names:
            path = Path(here, name)
            if path.is_file() and not path.is_symlink():
                yield path


def installed_hash(share: Path, interface: str) -> str:
    """Return the RIHS01 hash that rosidl installed beside the interface, "" if there is none."""
    return next((found for name in (PACKAGE, INTERFACES_PACKAGE) if (found := _hash_in(share, name, interface))), "")


def _hash_in(share: Path, package: str, interface: str) -> str:
    described = _read_json(share / package / f"{interface}.json")
    entries = described.get("type_hashes") if isinstance(described, dict) else None
    for entry in entries if isinstance(entries, list) else []:
        if isinstance(entry, dict) and entry.get("type_name") == f"{package}/{interface}":
            return str(entry.get("hash_string", ""))[:80]
    return ""


def interface_text(share: Path, interface: str) -> str:
    """Return the text of an interface ("msg/SensorFusionData") as a package has installed it, "" if there is none."""
    kind, name = interface.split("/")
    for package in (PACKAGE, INTERFACES_PACKAGE):
        path = share / package / kind / f"{name}.{kind}"
        if path.is_file() and not path.is_symlink() and path.stat().st_size < _JSON_CAP:
            return path.read_text(errors="replace")
    return ""


def _read_json(path: Path) -> Any:
    try:
        if path.is_symlink() or path.stat().st_size > _JSON_CAP:
            return None
        return json.loads(path.read_text())
    except (OSError, ValueError, RecursionError):
        return None
