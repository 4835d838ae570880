"""What a build left behind: take away what would lead a reader out of the install tree, and name what tampers.

A build is the submission's code, and so is every byte that it installs. Readers on our side follow no link out of the
tree and wait for no pipe because `tidy` has been here first.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import re
import stat
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from grader import toolchain
from grader.evidence import Flag
from grader.intake.names import printable

_HARMLESS_GROUPS = ("console_scripts", "gui_scripts")
_MOST = 20
_OWN = ("ros2_robot_controller", "ros2_robot_controller_interfaces")


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


def text(path: Path, cap: int = 5_000_000) -> str | None:
    """Return the text of a file that a submission may have made; None if it is no plain file, or longer than `cap`."""
    try:
        with opened(path) as stream:
            if os.fstat(stream.fileno()).st_size > cap:
                return None
            return stream.read(cap).decode("utf-8", "surrogateescape")
    except OSError:
        return None


_MOST_PYTHON = 5_000_000
# The encodings in which people write. Others can hide code, or take hours to be read.
_ENCODINGS = re.compile(r"utf-8(-sig)?|ascii|iso8859-\d+|cp\d+|mac-\w+|koi8-\w|gbk?|gb\w+|big5\w*|shift_jis\w*|euc_\w+")
_COOKIE = re.compile(r"^([ \t\f]*#.*?coding[:=][ \t]*)[-\w.]+", re.ASCII)


def python(path: Path) -> str | None:
    """Return a Python source as Python reads it, so that it can be written as UTF-8 and still be the same module.

    The encoding that it declares is undone and a byte order mark taken away, lines end as on Linux, and no form
    feed stands in the indentation. None if it is no plain file, too long, or in no encoding in which people write.
    """
    try:
        with opened(path) as stream:
            if os.fstat(stream.fileno()).st_size > _MOST_PYTHON:
                return None
            data = stream.read(_MOST_PYTHON).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        declared, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
        encoding = codecs.lookup(declared).name
        if not _ENCODINGS.fullmatch(encoding):
            return None
        lines = data.decode(encoding).split("\n")
    except (OSError, SyntaxError, ValueError, LookupError):
        return None
    lines[:2] = [_COOKIE.sub(r"\1utf-8", line) for line in lines[:2]]
    return "\n".join(line[1 + indent :] if (indent := _last_form_feed(line)) >= 0 else line for line in lines)


def _last_form_feed(line: str) -> int:
    """Return where the last form feed in a line's indentation stands, -1 if there is none: Python counts on from it."""
    return line.rfind("\f", 0, len(line) - len(line.lstrip(" \t\f"))) if "\f" in line else -1


def opened(path: Path) -> BinaryIO:
    """Open a plain file for reading, following no link and waiting for nobody who writes into a pipe of its name.

    Raises:
        OSError: there is none.
    """
    stream = os.fdopen(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb")
    if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.close()
        raise OSError(f"{path} is no plain file")
    return stream


def suspicious(install: Path) -> list[Flag]:
    """Return what in an install tree would change programs other than the package's own."""
    site = install / toolchain.SITE_IN_PREFIX
    return list(_in_site(site))[:_MOST] if site.is_dir() else []


def _in_site(site: Path) -> Iterator[Flag]:
    for path in sorted(site.iterdir()):
        name = path.stem if path.is_file() else path.name
        where = f"{toolchain.SITE_IN_PREFIX}/{printable(path.name)}"
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
    ours = toolchain.SITE_PACKAGES
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
