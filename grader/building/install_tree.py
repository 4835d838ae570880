"""Make an install tree safe to read, flag what tampers with other programs or poses as types, and read interfaces.

The submission's code runs during a build, so every installed byte is untrusted. The grader's readers can follow no
link out of the tree, and block on no pipe, because `remove_unsafe_entries` runs first. What ROS's tools make of the
interfaces (type hashes, Python modules), the grader makes once more itself, in a sandbox that runs nothing of the
submission (`worker.py`), and compares.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from grader import sandbox
from grader.course import Course
from grader.evidence import Flag
from grader.host import ros_env
from grader.processes.kept import Kept
from grader.sandbox import untrusted
from grader.sanitize import printable

_WORKER = Path(__file__).with_name("worker.py")
_MAX_HASHES_BYTES = 100_000
_MAX_FILES = 200
_SUFFIXES = (".msg", ".srv", ".action")


@dataclass(frozen=True)
class Generated:
    """What ROS's tools make of a package's definitions.

    Attributes:
        hashes: the RIHS01 hash of each interface, by its name "srv/SetSpeed".
        modules: the SHA-256 of each Python module, by its path "srv/_set_speed.py" in the Python package.
        exports: the text of each `__init__.py`, by its path.
    """

    hashes: dict[str, str] = field(default_factory=dict)
    modules: dict[str, str] = field(default_factory=dict)
    exports: dict[str, str] = field(default_factory=dict)


def generate(texts: Mapping[str, str], package: str, cache: Path) -> Generated:
    """Return what ROS's tools make of the definitions in `texts`, which are keyed "srv/SetSpeed.srv".

    A definition that they cannot read is left out. `package` is the name of the package that holds the definitions; it
    is part of what is hashed.
    """
    if not texts:
        return Generated()
    kept, decided_by = Kept(cache / "hashes"), (package, json.dumps(sorted(texts.items())))
    if earlier := kept.find(Generated, *decided_by):
        return earlier[0]
    with tempfile.TemporaryDirectory(prefix="hashes-") as name:
        folder = Path(name)
        (folder / "out").mkdir()
        (folder / "texts.json").write_text(json.dumps({"package": package, "texts": dict(texts)}))
        box = sandbox.Sandbox(
            read_only={_WORKER: "/ws/worker.py", folder / "texts.json": "/ws/texts.json"},
            writable={folder / "out": "/ws/out"},
            environment=ros_env.environment(home=sandbox.HOME),
        )
        command = ["python3", "/ws/worker.py", "/ws/texts.json", "/ws/out/made.json"]
        result = sandbox.run(command, box, sandbox.Limits(wall_seconds=60.0))
        try:
            found = Generated(**json.loads((folder / "out" / "made.json").read_text()))
        except (OSError, ValueError, TypeError):
            return Generated()
    if result.ok:
        kept.keep(found, *decided_by)
    return found


def definitions(folder: Path) -> dict[str, str]:
    """Return the texts of the interface definitions below a package's folder, keyed "srv/SetSpeed.srv".

    Where two have the same key, the shallower one counts.
    """
    found: dict[str, str] = {}
    paths = [Path(here, name) for here, _, names in os.walk(folder) for name in names if name.endswith(_SUFFIXES)]
    for path in sorted(paths, key=lambda path: (len(path.parts), path))[:_MAX_FILES]:
        text = untrusted.read_text(path, _MAX_HASHES_BYTES, errors="replace", newline=None)
        if text is not None:
            found.setdefault(f"{path.parent.name}/{path.name}", text)
    return found


_HARMLESS_GROUPS = ("console_scripts", "gui_scripts")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,99}")
# A package's name is also that of a target, and CMake keeps these for itself.
_RESERVED = ("all", "clean", "help", "install", "package", "package_source", "test", "edit_cache", "rebuild_cache")
_MAX_FLAGS = 20
_MAX_BYTES = 1_000_000
_BYTE_CODE = (".pyc", ".pyo")
_TYPE_FOLDERS = ("msg", "srv", "action")
_MAX_LISTED = 50


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
                    words = f"the build installed a link to {printable(str(path.readlink()))}"
                    flags.append(Flag("link out", words, where=where))
                    path.unlink()
                elif (target := path.readlink()).is_absolute():  # which leads nowhere outside of the sandbox
                    path.unlink()
                    path.symlink_to(os.path.relpath(root / target.relative_to(inside), path.parent))
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


def remove_byte_code(install: Path) -> list[Flag]:
    """Remove all byte code from an install tree; return a flag for each file that is not where Python writes it.

    Python itself writes byte code into `__pycache__`, beside the source from which it is made, and no links.
    """
    flags = []
    for path in sorted(path for path in install.rglob("*") if path.suffix in _BYTE_CODE or path.name == "__pycache__"):
        is_link = path.is_symlink()
        if is_link or (path.is_file() and path.parent.name != "__pycache__"):
            words = "a link that Python loads as byte code" if is_link else "byte code in place of a module's text"
            where = printable(str(path.relative_to(install)))
            flags.append(Flag("byte code", f"the build installed {words}; it was removed", where=where))
        if is_link or path.is_file():
            path.unlink()
    return flags


def not_generated(install: Path, generated: Mapping[str, Generated]) -> list[str]:
    """Return the paths of Python among the types that ROS's tools do not make, and of libraries there.

    `generated` is what they make of each package of interfaces, by its name.
    """
    site = install / ros_env.SITE_IN_PREFIX
    found = []
    for path in sorted(path for folder in _TYPE_FOLDERS for path in site.glob(f"*/{folder}/**/*")):
        package, _, name = path.relative_to(site).as_posix().partition("/")
        made, known = generated.get(package, Generated()), path.suffix != ".so"
        if path.suffix == ".py" and path.is_file():
            data = untrusted.read_bytes(path.resolve()) or b""
            lines = set(data.decode("utf-8", "replace").splitlines())
            known = made.modules.get(name) == hashlib.sha256(data).hexdigest()
            known = known or lines <= set(made.exports.get(name, "").splitlines())
        if not known:
            found.append(printable(path.relative_to(install).as_posix()))
    return found[:_MAX_LISTED]


def regular_files(folder: Path) -> Iterator[Path]:
    """Yield the regular files below `folder`, without following links."""
    for here, _, names in os.walk(folder):
        for name in names:
            path = Path(here, name)
            if path.is_file() and not path.is_symlink():
                yield path


def shared_file(share: Path, path: str) -> str:
    """Return where a package's share folder holds a file such as launch/x.py, "" if it does not.

    `ros2 launch` looks for its file anywhere in the share folder, and a launch file for its parameters where it likes.
    """
    wanted = Path(path)
    found = {str(file.relative_to(share)) for file in regular_files(share) if file.name == wanted.name}
    return path if path in found else min(found, default="")


def main_package(install: Path, wanted: str, course: Course) -> str:
    """Return the name under which a build has installed the package: the course's, else `wanted`, else any.

    It is "" if there is none. setup.py can install a package under another name than its package.xml has.
    """
    names = sorted(path.parent.name for path in (install / "share").glob("*/package.xml"))
    own = [name for name in names if not _hashed_interfaces(install, name, course)] or names
    return next((name for name in (course.package, wanted, *own) if name in names), "")


def interfaces_package(install: Path, package: str, course: Course) -> str:
    """Return the name of the package in which a build has installed the contract's interfaces.

    That is `package` itself if it has any of them, else the package that has most, else the contract's.
    """
    share = install / "share"
    names = [path.name for path in share.iterdir()] if share.is_dir() else []
    free = (name for name in sorted(names) if _is_free(name))
    counts = {name: count for name in free if (count := _hashed_interfaces(install, name, course))}
    return package if package in counts else max(counts, key=lambda name: counts[name], default=course.package)


def _hashed_interfaces(install: Path, package: str, course: Course) -> int:
    return sum(bool(installed_hash(install / "share", package, name)) for name in course.interfaces)


def _is_free(package: str) -> bool:
    """Return whether a package may have this name: one of ROS's own would hide that from the observer."""
    taken = package in _RESERVED or _shadows(package) or ros_env.has_package(package)
    return _NAME.fullmatch(package) is not None and not taken


def installed_hash(share: Path, package: str, interface: str) -> str:
    """Return the RIHS01 hash that rosidl has installed beside an interface of `package`, "" if there is none."""
    described = untrusted.read_json(share / package / f"{interface}.json", _MAX_BYTES)
    entries = described.get("type_hashes") if isinstance(described, dict) else None
    for entry in entries if isinstance(entries, list) else []:
        if isinstance(entry, dict) and entry.get("type_name") == f"{package}/{interface}":
            return str(entry.get("hash_string", ""))[:80]
    return ""


def interface_text(install: Path, interface: str, package: str) -> str:
    """Return the installed text of an interface such as "msg/SensorFusionData" of `package`, "" if there is none."""
    kind, name = interface.split("/")
    path = install / "share" / package / kind / f"{name}.{kind}"
    return untrusted.read_text(path, _MAX_BYTES, errors="replace", newline=None) or ""


def programs(folder: Path) -> list[str]:
    """Return the names of the programs in a folder."""
    files = [path for path in folder.iterdir() if path.is_file()] if folder.is_dir() else []
    return sorted(path.name for path in files if path.stat().st_mode & stat.S_IXUSR)


def misplaced_nodes(install: Path, package: str, course: Course) -> dict[str, str]:
    """Return the nodes that are installed where `ros2 run` does not look, each with the folder that it is in."""
    home = install / "lib" / package
    folders = [install / "bin", *(path for path in sorted((install / "lib").glob("*")) if path != home)]
    missing = set(course.nodes) - set(programs(home))
    found: dict[str, str] = {}
    for folder in folders:
        for name in sorted(missing & set(programs(folder))):
            found.setdefault(name, folder.relative_to(install).as_posix())
    return found


def link_misplaced(install: Path, package: str, folders: Iterable[str]) -> None:
    """Link the programs in other folders of an install tree to where `ros2 run` looks: only I1 is about the place."""
    home = install / "lib" / package
    home.mkdir(parents=True, exist_ok=True)
    for folder in sorted(set(folders)):
        for name in programs(install / folder):
            with contextlib.suppress(FileExistsError):
                (home / name).symlink_to(os.path.relpath(install / folder / name, home))
