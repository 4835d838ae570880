"""The cache of builds: keyed by everything that decides a result, sealed against damage, locked against races."""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path

from grader import evidence
from grader.build.install_tree import regular_files
from grader.host import ros_env


def cache_folder() -> Path:
    """Return the folder for builds: $ROS2_COURSE_KIT_CACHE, or the user's cache folder."""
    chosen = os.environ.get("ROS2_COURSE_KIT_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(chosen or Path(base) / "ros2-course-kit").expanduser()


def tree_folder(source: Path, cache: Path) -> Path | None:
    """Return the place of the build tree for this content, None where going on from one would not be safe.

    The tree depends on what CMake reads. Python modules, launch files, parameters and tests are only copied by it, so
    they are left out of the key; unless the build can run something: then one submission's code could leave its mark
    in a tree that another one goes on from, and there is no tree.
    """
    digest = hashlib.sha256(b"sealed" + _toolchain_id().encode() + ros_env.CMAKE_HOOK.read_bytes())
    for path in sorted(regular_files(source)):
        relative = path.relative_to(source)
        if path.suffix == ".cmake" or path.name in ("colcon.pkg", "colcon.meta"):
            return None
        if path.name == "CMakeLists.txt" and not _only_declares(path.read_text("latin")):
            return None
        if path.name == "package.xml" and "<build_type>ament_cmake</build_type>" not in path.read_text("latin"):
            return None
        if path.name in ("CMakeLists.txt", "package.xml") or path.suffix in (".msg", ".srv", ".action", ".idl"):
            digest.update(f"{relative}\0".encode("utf-8", "surrogateescape"))
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return cache / "trees" / digest.hexdigest()[:40]


def _only_declares(cmake: str) -> bool:
    """Return whether a CMakeLists.txt holds nothing but commands that run no code of the package."""
    # Whole-line comments do not count, except where a string or a bracket argument could end in one.
    lines = [line for line in cmake.splitlines() if not line.lstrip().startswith("#") or set(line) & set('"]')]
    code = _HARMLESS_VARIABLE.sub("files", "\n".join(lines))
    commands = {name.lower() for name in re.findall(r"\b(\w+)\s*\(", code)}
    if not commands <= _DECLARATIONS or _LOADS_CODE.search(code.replace("cmake_minimum_required", "")):
        return False
    # CMake and rosidl keep in variables which programs they run, and a name can be put together from others.
    variables = re.findall(r"\bset\s*\(\s*([^\s)]*)", code, re.IGNORECASE)
    options = re.findall(r"\badd_compile_options\s*\(([^)]*)", code, re.IGNORECASE)
    return all(_LISTS.fullmatch(name) for name in variables) and all(
        _WARNS.fullmatch(option) for found in options for option in found.split()
    )


_DECLARATIONS = {
    "cmake_minimum_required", "project", "find_package", "rosidl_generate_interfaces", "ament_get_python_install_dir",
    "install", "ament_package", "ament_export_dependencies", "if", "elseif", "else", "endif", "set", "message",
    "ament_lint_auto_find_test_dependencies", "ament_add_pytest_test", "add_compile_options",
}  # fmt: skip


_HARMLESS_VARIABLE = re.compile(r"\bCMAKE_(CXX_STANDARD|C_STANDARD|COMPILER_IS_GNUCXX|CXX_COMPILER_ID)\b")


_LOADS_CODE = re.compile(
    r"\bCMAKE_(?!CURRENT)|RULE_LAUNCH|CONFIG_EXTRAS|\b(CODE|SCRIPT|ENV|PATHS|HINTS)\b", re.IGNORECASE
)


_LISTS = re.compile(
    r"(?!ament|rosidl|python|_)(\w+_)?(msg|srv|action|interface|file|dep|dependencie|script|source|node|executable)s?",
    re.IGNORECASE,
)


_WARNS = re.compile(r"-W[a-z][a-z-]*")


def key(packages: Sequence[Path]) -> str:
    """Return a hash of everything that decides a build's result."""
    digest = hashlib.sha256()
    ours = (ros_env.CMAKE_HOOK, *sorted(Path(__file__).parent.glob("*.py")))
    for part in (_toolchain_id(), *(path.read_text() for path in ours)):
        digest.update(part.encode() + b"\0")
    for package in packages:
        for path in sorted(_sources(package)):
            mode = "x" if path.stat().st_mode & 0o100 else "-"
            digest.update(f"{package.name}/{path.relative_to(package)}\0{mode}\0".encode("utf-8", "surrogateescape"))
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:40]


def _sources(package: Path) -> Iterator[Path]:
    for path in regular_files(package):
        if not any(part in _IGNORED for part in path.relative_to(package).parts):
            yield path


_IGNORED = ("__pycache__", ".git", "build", "install", "log", ".pytest_cache")


def not_source(folder: str, names: list[str]) -> list[str]:
    """Return which of `names` in a folder are not copied into a build: for shutil.copytree."""
    return [name for name in names if name in _IGNORED or Path(folder, name).is_symlink()]


def _toolchain_id() -> str:
    versions = sorted(
        f"{d.name}={d.version}" for d in metadata.distributions() if d.name.startswith(("ros-jazzy", "colcon", "cmake"))
    )
    return "\n".join([str(ros_env.PREFIX), str(ros_env.BASE_PREFIX), *versions])


def load(folder: Path) -> evidence.Build | None:
    """Return the facts of a finished build, None if there is none or it is damaged (it is then built again)."""
    try:
        facts = evidence.from_json((folder / "build.json").read_text(), evidence.Build)
    except (OSError, ValueError):
        return None
    return facts if is_sealed(folder / "install", folder / "install") else None


def seal(name: Path, content: Path) -> None:
    """Write down beside `name`, where it is or will be, what `content` holds."""
    name.with_suffix(".seal").write_text(_content(content))


def is_sealed(name: Path, content: Path) -> bool:
    """Return whether `content` is what was sealed as `name`: a disk, or somebody tidying up, may have damaged it."""
    try:
        return name.with_suffix(".seal").read_text() == _content(content)
    except OSError:
        return False


def _content(root: Path) -> str:
    """Return a hash of the names, kinds and bytes of everything below `root`; Python's own caches do not count."""
    digest = hashlib.sha256()
    for here, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if name != "__pycache__")
        for name in sorted([*names, *folders]):
            path = Path(here, name)
            digest.update(f"{path.relative_to(root)}\0".encode("utf-8", "surrogateescape"))
            if path.is_symlink():
                digest.update(b"link" + os.fsencode(path.readlink()))
            elif path.is_file():
                executable = path.stat().st_mode & stat.S_IXUSR
                digest.update(b"x" if executable else b"-")
                digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold `path` locked, so that two gradings never build the same thing at once."""
    with path.open("w") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        yield
