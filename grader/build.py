"""`colcon build` inside the wall, cached by content: what goes in decides the key, so the same input builds once.

Generating and compiling the interfaces is nearly all of a build, and most submissions share them. So a build tree is
kept for each content of everything that CMake reads, and a submission that differs in Python, launch files or
parameters alone goes on from a copy of it: 3 s instead of 12 to 25.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

from grader import evidence, leavings, sandbox, scratch, shortage, toolchain, type_hashes
from grader.errors import GraderError

PACKAGE = "ros2_robot_controller"
INTERFACES_PACKAGE = f"{PACKAGE}_interfaces"  # the name under which a submission may split its interfaces off
CONTRACT = Path(__file__).parent / "contract" / PACKAGE
INTERFACES = ("srv/SetSpeed", "srv/GetRobotStatus", "action/NavigateToPosition", "msg/SensorFusionData")

# The same paths in every wall: the compiler cache recognises the generated code of a class of submissions by them.
_SOURCE, _BUILD, _INSTALL, _CCACHE = "/ws/src", "/ws/build", "/ws/install", "/ws/ccache"
_LOG_TAIL = 8000
_JSON_CAP = 1_000_000


@dataclass(frozen=True)
class Built:
    """A finished build: the facts, and the install tree on the host (its place inside walls is `INSTALL`)."""

    facts: evidence.Build
    install: Path


INSTALL = Path(_INSTALL)


def cache_folder() -> Path:
    """Return the folder for builds: $ROS2_COURSE_KIT_CACHE, or the user's cache folder."""
    chosen = os.environ.get("ROS2_COURSE_KIT_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(chosen or Path(base) / "ros2-course-kit").expanduser()


def contract(cache: Path, package: str = PACKAGE) -> Built:
    """Return the contract's own interfaces, built once on this machine. The observer talks with these types.

    `package` is the name that they bear; INTERFACES_PACKAGE for a submission that has split them off.

    Raises:
        GraderError: they do not build here.
    """
    with tempfile.TemporaryDirectory(prefix="contract-") as room:
        source = CONTRACT if package == PACKAGE else _renamed(CONTRACT, Path(room) / package)
        built = build([source], cache, seconds=600.0, trusted=True, main=package)
    if not built.facts.ok:
        raise GraderError(
            f"The contract's own interfaces do not build on this machine:\n{built.facts.log_tail}\nRun `grader doctor`."
        )
    return built


def types_package(install: Path) -> str:
    """Return the package under whose name a build has the contract's interfaces."""
    split = any(_hash_in(install / "share", INTERFACES_PACKAGE, name) for name in INTERFACES)
    whole = any(_hash_in(install / "share", PACKAGE, name) for name in INTERFACES)
    return INTERFACES_PACKAGE if split and not whole else PACKAGE


def _renamed(source: Path, target: Path) -> Path:
    """Copy a package of interfaces under another name, the folder's, and return it."""
    shutil.copytree(source, target)
    for path in (target / "package.xml", target / "CMakeLists.txt"):
        path.write_text(path.read_text().replace(source.name, target.name))
    return target


def contract_is_built(cache: Path) -> bool:
    """Return whether `contract` will answer at once."""
    return _load(cache / "builds" / _key([CONTRACT])) is not None


def build(
    packages: Sequence[Path], cache: Path, *, seconds: float = 300.0, trusted: bool = False, main: str = PACKAGE
) -> Built:
    """Build the package folders walled in and return the facts and the install tree.

    A second build of the same content takes the first one's result. Only the kit's own builds (`trusted`) fill the
    compiler cache; submissions read it, so that none can plant an object file for another. `main` is the package
    without which nothing counts as built.

    Raises:
        GraderError: no wall, no disk or no compiler. A package that does not compile is a fact, not an error.
    """
    folder = cache / "builds" / _key(packages)
    try:
        return _cached_or_built(packages, folder, cache / "ccache", seconds, trusted, main)
    except OSError as error:
        said = shortage.words(error) or f"Cannot write the build to {folder.parent}: {error}. Choose another --cache."
        raise GraderError(said) from error


def _cached_or_built(
    packages: Sequence[Path], folder: Path, ccache: Path, seconds: float, trusted: bool, main: str
) -> Built:
    folder.parent.mkdir(parents=True, exist_ok=True)
    with _locked(folder.with_suffix(".lock")):
        facts = _load(folder)
        if facts is not None:
            return Built(replace(facts, cached=True), folder / "install")
        for left in folder.parent.glob(f"{folder.name[:12]}.*.work"):  # by a grader that was killed
            scratch.remove(left)
        if missing := toolchain.missing_tools():
            raise GraderError(
                f"This machine has no {' and no '.join(missing)}, so no package can be built. Run `grader doctor`; it "
                "prints the command that installs what is missing."
            )
        return _build(packages, folder, ccache, seconds, trusted, main)


def _build(packages: Sequence[Path], folder: Path, ccache: Path, seconds: float, trusted: bool, main: str) -> Built:
    ccache.mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(prefix=folder.name[:12] + ".", suffix=".work", dir=folder.parent))
    try:
        for name in ("src", "build", "install"):
            (work / name).mkdir()
        for package in packages:
            shutil.copytree(package, work / "src" / package.name, symlinks=True, ignore=_not_source)
        _make_old(work / "src")
        tree = _tree(work / "src", folder.parent.parent)
        if tree is not None and tree.is_dir():
            shutil.copytree(tree, work / "build", symlinks=True, dirs_exist_ok=True)
            if not _is_sealed(tree, work / "build"):  # damaged: begin with nothing, and put a sound one there
                scratch.remove(tree)
                scratch.remove(work / "build")
                (work / "build").mkdir()
        result = _colcon(work, ccache, seconds, trusted)
        if result.stopped == "disk":  # what nobody can count, nobody should read
            scratch.remove(work / "install")
            (work / "install").mkdir()
        removed = [] if trusted else leavings.tidy(work / "install", _INSTALL)
        facts = _facts(result, work / "install", main)
        if not trusted:
            facts = _checked(facts, work, removed, folder.parent.parent)
        if tree is not None and facts.ok and not tree.is_dir():
            tree.parent.mkdir(parents=True, exist_ok=True)
            with contextlib.suppress(OSError):  # another grading has put it there meanwhile
                (work / "build").rename(tree)
                _seal(tree, tree)
        scratch.remove(work / "build")
        (work / "build.json").write_text(evidence.to_json(facts))
        _seal(work / "install", work / "install")
        if result.timed_out or result.stopped:
            # A build that ran out of time or memory may fare better on a quieter day: keep it out of the cache.
            folder = folder.with_name(work.name + ".timeout")
        elif folder.exists():
            scratch.remove(folder)
        work.rename(folder)
    finally:
        scratch.remove(work)
    return Built(facts, folder / "install")


def _make_old(source: Path) -> None:
    """Give every source one and the same old time: whether a build tree is up to date is decided by content alone."""
    for path in source.rglob("*"):
        if not path.is_symlink():
            os.utime(path, (_OLD, _OLD))


_OLD = 1_000_000_000


def _tree(source: Path, cache: Path) -> Path | None:
    """Return the place of the build tree for this content, None where going on from one would not be safe.

    The tree depends on what CMake reads. Python modules, launch files, parameters and tests are only copied by it, so
    they are left out of the key; unless the build can run something: then one submission's code could leave its mark
    in a tree that another one goes on from, and there is no tree.
    """
    digest = hashlib.sha256(b"sealed" + _toolchain_id().encode() + toolchain.CMAKE_HOOK.read_bytes())
    for path in sorted(_files(source)):
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


def _colcon(work: Path, ccache: Path, seconds: float, trusted: bool) -> sandbox.RunResult:
    environment = toolchain.environment(home=sandbox.HOME)
    launchers = []
    if shutil.which("ccache"):
        environment |= {"CCACHE_DIR": _CCACHE, "CCACHE_NOHASHDIR": "1", "CCACHE_BASEDIR": "/ws", "CCACHE_NOSTATS": "1"}
        environment |= {} if trusted else {"CCACHE_READONLY": "1", "CCACHE_TEMPDIR": "/tmp"}
        launchers = [f"-DCMAKE_{language}_COMPILER_LAUNCHER=ccache" for language in ("C", "CXX")]
    wall = sandbox.Wall(
        read_only={work / "src": _SOURCE, toolchain.CMAKE_HOOK: "/ws/wheel_prefix.cmake"}
        | ({} if trusted else {ccache: _CCACHE}),
        writable={work / "build": _BUILD, work / "install": _INSTALL} | ({ccache: _CCACHE} if trusted else {}),
        environment=environment,
        cwd="/ws",
    )
    command = [
        "colcon", "--log-base", "/tmp/log", "build", "--base-paths", _SOURCE, "--build-base", _BUILD,
        "--install-base", _INSTALL, "--merge-install", "--event-handlers", "console_direct+", "status-",
        "--cmake-args", "-G", "Ninja", "-DCMAKE_PROJECT_INCLUDE=/ws/wheel_prefix.cmake", "-DBUILD_TESTING=OFF",
        *launchers,
    ]  # fmt: skip
    return sandbox.run(command, wall, sandbox.Limits(wall_seconds=seconds))


def _facts(result: sandbox.RunResult, install: Path, package: str) -> evidence.Build:
    share = install / "share"
    return evidence.Build(
        ok=result.ok and (share / package / "package.xml").is_file(),
        cached=False,
        wall_seconds=round(result.wall_seconds, 1),
        exit_code=result.exit_code,
        timed_out=result.timed_out,
        log_tail=_readable(result.output)[-_LOG_TAIL:],
        stopped=result.stopped,
        executables=sorted(p.name for p in _files(install / "lib" / PACKAGE) if p.stat().st_mode & 0o111),
        shared_files=sorted(str(p.relative_to(share / PACKAGE)) for p in _files(share / PACKAGE)),
        type_hashes={name: found for name in INTERFACES if (found := _type_hash(share, name))},
        interface_texts={name: text for name in INTERFACES if (text := interface_text(share, name))},
    )


def _checked(facts: evidence.Build, work: Path, removed: list[evidence.Flag], cache: Path) -> evidence.Build:
    """Return the facts with type hashes that hold against the interfaces' text, and with what looks like tampering.

    The hashes beside the installed interfaces were written by the submission's build. Where the text says otherwise
    the hash is neither one nor the other, so that it never passes for the contract's.
    """
    share = work / "install" / "share"
    package = types_package(work / "install")
    handed_in = type_hashes.texts_in(work / "src")
    installed = {f"{name}.{name.partition('/')[0]}": text for name, text in facts.interface_texts.items()}
    # A definition that CMake generates stands nowhere in the source; then the one that it installed counts.
    texts = {**installed, **handed_in}
    computed = type_hashes.of(texts, package, cache) if facts.ok else {}
    hashes, flags = {}, []
    for name in INTERFACES:
        found = _type_hash(share, name)
        if found and found == computed.get(name):
            hashes[name] = found
        elif found:
            hashes[name] = "the installed hash is not that of the text"
            flags.append(
                evidence.Flag(
                    "forged type", f"the hash installed for {name} is not that of its text", where=f"{name}.json"
                )
            )
    return replace(facts, type_hashes=hashes, flags=[*removed, *flags, *leavings.suspicious(work / "install")])


def _readable(log: str) -> str:
    """Return a build's log without what only concerns this machine: where the wheels lie, and that they lie there."""
    lines = [line for line in log.splitlines() if "doesn't contain any 'local_setup.*' files" not in line]
    return "\n".join(lines).replace(str(toolchain.PREFIX), "<ros>")


def _files(folder: Path) -> Iterator[Path]:
    """Yield the regular files below `folder`, links not followed."""
    for here, _, names in os.walk(folder):
        for name in names:
            path = Path(here, name)
            if path.is_file() and not path.is_symlink():
                yield path


def _type_hash(share: Path, interface: str) -> str:
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


def _key(packages: Sequence[Path]) -> str:
    """Return a hash of everything that decides a build's result."""
    digest = hashlib.sha256()
    ours = (toolchain.CMAKE_HOOK, Path(__file__), Path(leavings.__file__), Path(type_hashes.__file__))
    for part in (_toolchain_id(), *(path.read_text() for path in ours)):
        digest.update(part.encode() + b"\0")
    for package in packages:
        for path in sorted(_sources(package)):
            mode = "x" if path.stat().st_mode & 0o100 else "-"
            digest.update(f"{package.name}/{path.relative_to(package)}\0{mode}\0".encode("utf-8", "surrogateescape"))
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:40]


def _sources(package: Path) -> Iterator[Path]:
    for path in _files(package):
        if not any(part in _IGNORED for part in path.relative_to(package).parts):
            yield path


_IGNORED = ("__pycache__", ".git", "build", "install", "log", ".pytest_cache")


def _not_source(folder: str, names: list[str]) -> list[str]:
    return [name for name in names if name in _IGNORED or Path(folder, name).is_symlink()]


def _toolchain_id() -> str:
    versions = sorted(
        f"{d.name}={d.version}" for d in metadata.distributions() if d.name.startswith(("ros-jazzy", "colcon", "cmake"))
    )
    return "\n".join([str(toolchain.PREFIX), str(toolchain.BASE_PREFIX), *versions])


def _load(folder: Path) -> evidence.Build | None:
    """Return the facts of a finished build, None if there is none or it is damaged (it is then built again)."""
    try:
        facts = evidence.from_json((folder / "build.json").read_text(), evidence.Build)
    except (OSError, ValueError):
        return None
    return facts if _is_sealed(folder / "install", folder / "install") else None


def _seal(name: Path, content: Path) -> None:
    """Write down beside `name`, where it is or will be, what `content` holds."""
    name.with_suffix(".seal").write_text(_content(content))


def _is_sealed(name: Path, content: Path) -> bool:
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
def _locked(path: Path) -> Iterator[None]:
    """Hold `path` locked, so that two gradings never build the same thing at once."""
    with path.open("w") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        yield
