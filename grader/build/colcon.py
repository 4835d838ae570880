"""`colcon build` inside the box, cached by content: what goes in decides the key, so the same input builds once.

Generating and compiling the interfaces is nearly all of a build, and most submissions share them. So a build tree is
kept for each content of everything that CMake reads, and a submission that differs in Python, launch files or
parameters alone goes on from a copy of it: 3 s instead of 12 to 25.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader import evidence, sandbox
from grader.build import install_tree, type_hashes
from grader.build.cache import is_sealed, key, load, locked, not_source, seal, tree_folder
from grader.build.install_tree import installed_hash, interface_text, regular_files, types_package
from grader.contract.spec import CONTRACT, INTERFACES, PACKAGE
from grader.errors import GraderError
from grader.host import ros_env, shortage, tempdir

# The same paths in every box: the compiler cache recognises the generated code of a class of submissions by them.
_SOURCE, _BUILD, _INSTALL, _CCACHE = "/ws/src", "/ws/build", "/ws/install", "/ws/ccache"


_LOG_TAIL = 8000


@dataclass(frozen=True)
class Built:
    """A finished build: the facts, and the install tree on the host (its place inside walls is `INSTALL`)."""

    facts: evidence.Build
    install: Path


INSTALL = Path(_INSTALL)


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


def _renamed(source: Path, target: Path) -> Path:
    """Copy a package of interfaces under another name, the folder's, and return it."""
    shutil.copytree(source, target)
    for path in (target / "package.xml", target / "CMakeLists.txt"):
        path.write_text(path.read_text().replace(source.name, target.name))
    return target


def contract_is_built(cache: Path) -> bool:
    """Return whether `contract` will answer at once."""
    return load(cache / "builds" / key([CONTRACT])) is not None


def build(
    packages: Sequence[Path], cache: Path, *, seconds: float = 300.0, trusted: bool = False, main: str = PACKAGE
) -> Built:
    """Build the package folders walled in and return the facts and the install tree.

    A second build of the same content takes the first one's result. Only the kit's own builds (`trusted`) fill the
    compiler cache; submissions read it, so that none can plant an object file for another. `main` is the package
    without which nothing counts as built.

    Raises:
        GraderError: no box, no disk or no compiler. A package that does not compile is a fact, not an error.
    """
    folder = cache / "builds" / key(packages)
    try:
        return _cached_or_built(packages, folder, cache / "ccache", seconds, trusted, main)
    except OSError as error:
        said = shortage.explain(error) or f"Cannot write the build to {folder.parent}: {error}. Choose another --cache."
        raise GraderError(said) from error


def _cached_or_built(
    packages: Sequence[Path], folder: Path, ccache: Path, seconds: float, trusted: bool, main: str
) -> Built:
    folder.parent.mkdir(parents=True, exist_ok=True)
    with locked(folder.with_suffix(".lock")):
        facts = load(folder)
        if facts is not None:
            return Built(replace(facts, cached=True), folder / "install")
        for left in folder.parent.glob(f"{folder.name[:12]}.*.work"):  # by a grader that was killed
            tempdir.remove(left)
        if missing := ros_env.missing_tools():
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
            shutil.copytree(package, work / "src" / package.name, symlinks=True, ignore=not_source)
        _make_old(work / "src")
        tree = tree_folder(work / "src", folder.parent.parent)
        if tree is not None and tree.is_dir():
            shutil.copytree(tree, work / "build", symlinks=True, dirs_exist_ok=True)
            if not is_sealed(tree, work / "build"):  # damaged: begin with nothing, and put a sound one there
                tempdir.remove(tree)
                tempdir.remove(work / "build")
                (work / "build").mkdir()
        result = _colcon(work, ccache, seconds, trusted)
        if result.stopped == "disk":  # what nobody can count, nobody should read
            tempdir.remove(work / "install")
            (work / "install").mkdir()
        removed = [] if trusted else install_tree.tidy(work / "install", _INSTALL)
        facts = _facts(result, work / "install", main)
        if not trusted:
            facts = _checked(facts, work, removed, folder.parent.parent)
        if tree is not None and facts.ok and not tree.is_dir():
            tree.parent.mkdir(parents=True, exist_ok=True)
            with contextlib.suppress(OSError):  # another grading has put it there meanwhile
                (work / "build").rename(tree)
                seal(tree, tree)
        tempdir.remove(work / "build")
        (work / "build.json").write_text(evidence.to_json(facts))
        seal(work / "install", work / "install")
        if result.timed_out or result.stopped:
            # A build that ran out of time or memory may fare better on a quieter day: keep it out of the cache.
            folder = folder.with_name(work.name + ".timeout")
        elif folder.exists():
            tempdir.remove(folder)
        work.rename(folder)
    finally:
        tempdir.remove(work)
    return Built(facts, folder / "install")


def _make_old(source: Path) -> None:
    """Give every source one and the same old time: whether a build tree is up to date is decided by content alone."""
    for path in source.rglob("*"):
        if not path.is_symlink():
            os.utime(path, (_OLD, _OLD))


_OLD = 1_000_000_000


def _colcon(work: Path, ccache: Path, seconds: float, trusted: bool) -> sandbox.RunResult:
    environment = ros_env.environment(home=sandbox.HOME)
    launchers = []
    if shutil.which("ccache"):
        environment |= {"CCACHE_DIR": _CCACHE, "CCACHE_NOHASHDIR": "1", "CCACHE_BASEDIR": "/ws", "CCACHE_NOSTATS": "1"}
        environment |= {} if trusted else {"CCACHE_READONLY": "1", "CCACHE_TEMPDIR": "/tmp"}
        launchers = [f"-DCMAKE_{language}_COMPILER_LAUNCHER=ccache" for language in ("C", "CXX")]
    box = sandbox.Sandbox(
        read_only={work / "src": _SOURCE, ros_env.CMAKE_HOOK: "/ws/wheel_prefix.cmake"}
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
    return sandbox.run(command, box, sandbox.Limits(wall_seconds=seconds))


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
        executables=sorted(p.name for p in regular_files(install / "lib" / PACKAGE) if p.stat().st_mode & 0o111),
        shared_files=sorted(str(p.relative_to(share / PACKAGE)) for p in regular_files(share / PACKAGE)),
        type_hashes={name: found for name in INTERFACES if (found := installed_hash(share, name))},
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
    computed = type_hashes.compute(texts, package, cache) if facts.ok else {}
    hashes, flags = {}, []
    for name in INTERFACES:
        found = installed_hash(share, name)
        if found and found == computed.get(name):
            hashes[name] = found
        elif found:
            hashes[name] = "the installed hash is not that of the text"
            flags.append(
                evidence.Flag(
                    "forged type", f"the hash installed for {name} is not that of its text", where=f"{name}.json"
                )
            )
    return replace(facts, type_hashes=hashes, flags=[*removed, *flags, *install_tree.suspicious(work / "install")])


def _readable(log: str) -> str:
    """Return a build's log without what only concerns this machine: where the wheels lie, and that they lie there."""
    lines = [line for line in log.splitlines() if "doesn't contain any 'local_setup.*' files" not in line]
    return "\n".join(lines).replace(str(ros_env.PREFIX), "<ros>")
