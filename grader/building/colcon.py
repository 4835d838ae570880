"""Run `colcon build` in the sandbox. Results are cached by content, so the same input is built once.

Nearly all of a build's time goes into generating and compiling the interfaces, and most submissions share them. So a
build tree is kept for each content of the files that decide these, and a submission that differs only in Python, launch
files or parameters continues from a copy of it: 3 s instead of 12 to 25.
"""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader import evidence, sandbox
from grader.building import cache as build_cache
from grader.building import install_tree
from grader.course import Course
from grader.errors import GraderError
from grader.host import ros_env, shortage, submission_user, tempdir
from grader.words import mark, say

# The same paths in every sandbox: by them ccache recognises the generated code of a class's submissions.
_SOURCE, _BUILD, _INSTALL, _CCACHE = "/ws/src", "/ws/build", "/ws/install", "/ws/ccache"
INSTALL = Path(_INSTALL)
"""The path of the install tree in a sandbox."""
_LOG_TAIL = 8000
_TREE_FILES = re.compile(r"CMakeLists\.txt|package\.xml|colcon\.pkg|.*\.(cmake|in|msg|srv|action|idl)")
"""The names of the files from which a build tree is made that submissions share."""
_INTERFACES = (".msg", ".srv", ".action", ".idl")
_TREE_TIME = 1_000_000_000
"""When these files were written last, in every build: so their content decides what is built again, not their age."""
# A CMakeLists.txt of nothing but these commands, and without a test of files, looks at no other file to configure.
_DECLARE = {
    "cmake_minimum_required", "project", "find_package", "rosidl_generate_interfaces", "ament_get_python_install_dir",
    "install", "ament_package", "ament_export_dependencies", "if", "elseif", "else", "endif", "set", "message", "list",
    "foreach", "endforeach", "ament_lint_auto_find_test_dependencies", "ament_add_pytest_test", "add_compile_options",
}  # fmt: skip
_COMMAND, _COMMENT = re.compile(r"\b(\w+)\s*\("), re.compile(r"^[ \t]*#.*", re.MULTILINE)
_FILE_TEST = re.compile(r"(?<!\(BUILD_TESTING AND )\b(EXISTS|IS_[A-Z]+)\b")  # BUILD_TESTING is off


@dataclass(frozen=True)
class Built:
    """A finished build: the facts, and the install tree's path on the host (in a sandbox it is `INSTALL`)."""

    facts: evidence.Build
    install: Path


@dataclass(frozen=True)
class _Job:
    """The arguments of `build`."""

    packages: Sequence[Path]
    cache: Path
    course: Course
    seconds: float
    trusted: bool
    main: str
    far: Callable[[str], object]


FIRST_TIME = mark("building the contract's interfaces: once on this machine, about a minute, longer on a busy one")


_STEP = re.compile(r"^\[(\d+)/(\d+)\] (Generating|Building C |Building CXX |Linking)?.*$", re.MULTILINE)
_STEPS = {
    "Generating": mark("generating code"), "Building C ": mark("compiling C"), "Building CXX ": mark("compiling C++"),
    "Linking": mark("linking"),
}  # fmt: skip


def how_far(log: str) -> str:
    """Return how far a build is, from the last step in its log: "compiling C++: 21 of 43"; "" before the first one."""
    if not (steps := _STEP.findall(log)):
        return ""
    n, total, kind = steps[-1]
    far = say("{n} of {total}", n=n, total=total)
    return f"{say(_STEPS[kind])}: {far}" if kind else far


def build_contract(
    cache: Path, course: Course, package: str = "", far: Callable[[str], object] = lambda _far: None
) -> Built:
    """Return the course's own interfaces, built once on this machine. The observer uses these types.

    `package` is the name of the package that has them, for a submission that has them under another name. `far` is
    called about once a second with how far the build is.

    Raises:
        GraderError: they do not build here.
    """
    if not course.interfaces:
        unbuilt = evidence.Build(ok=False, package=course.package, types_package=course.package)
        return Built(unbuilt, course.path("contract"))  # as an overlay it is empty
    with tempfile.TemporaryDirectory(prefix="contract-") as folder:
        renamed = package not in ("", course.package)
        source = _copy_renamed(course.contract, Path(folder) / package) if renamed else course.contract
        built = build([source], cache, course, seconds=600.0, trusted=True, main=package, far=far)
    if not built.facts.ok:
        words = mark("The contract's own interfaces do not build on this machine:\n{log}\nRun `grader doctor`.")
        raise GraderError(say(words, log=built.facts.log_tail))
    return built


def _copy_renamed(source: Path, target: Path) -> Path:
    """Copy a package of interfaces to `target`, name it like that folder, and return the folder."""
    shutil.copytree(source, target)
    for path in (target / "package.xml", target / "CMakeLists.txt"):
        path.write_text(path.read_text().replace(source.name, target.name))
    return target


def contract_is_built(cache: Path, course: Course) -> bool:
    """Return whether `build_contract` will return at once."""
    return not course.interfaces or build_cache.load(_folder([course.contract], cache, course)) is not None


def build(
    packages: Sequence[Path], cache: Path, course: Course, *,
    seconds: float = 300.0, trusted: bool = False, main: str = "", far: Callable[[str], object] = lambda _far: None,
) -> Built:  # fmt: skip
    """Build the package folders in the sandbox and return the facts and the install tree.

    A second build of the same content returns the first one's result. Only the kit's own builds (`trusted`) write to
    the compiler cache; submissions just read it, so that none can plant an object file for another. `main` is the name
    of the package to look for in the install tree, by default the course's; a build that installs none counts as
    failed. `far` is called about once a second with how far it is, in words.

    Raises:
        GraderError: no sandbox, no disk space or no compiler. A package that does not compile is a fact, not an error.
    """
    folder = _folder(packages, cache, course)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with build_cache.locked(folder.with_suffix(build_cache.LOCK)):
            facts = build_cache.load(folder)
            if facts is not None:
                return Built(replace(facts, cached=True), folder / "install")
            for left in folder.parent.glob(f"{folder.name}.*.work"):  # by a grader that was killed
                tempdir.remove(left)
            if missing := ros_env.missing_tools():
                words = mark(
                    "This machine has no {tools}, so no package can be built. Run `grader doctor`; it prints the "
                    "command that installs what is missing."
                )
                raise GraderError(say(words, tools=say(" and no ").join(missing)))
            job = _Job(packages, cache, course, seconds, trusted, main or course.package, far)
            with submission_user.readable_by_sandboxes():
                return _build(job, folder)
    except OSError as error:
        words = mark("Cannot write the build to {path}: {why}. Choose another --cache.")
        raise GraderError(shortage.explain(error) or say(words, path=folder.parent, why=error)) from error


def _folder(packages: Sequence[Path], cache: Path, course: Course) -> Path:
    return cache / "builds" / build_cache.build_key(packages, repr(course.nodes), *course.interfaces)


def _build(job: _Job, folder: Path) -> Built:
    work = Path(tempfile.mkdtemp(prefix=folder.name + ".", suffix=".work", dir=folder.parent))
    try:
        for name in ("src", "build", "install"):
            (work / name).mkdir()
        _copy_sources(job.packages, work / "src")
        _copy_build_tree(job, work)
        result = _colcon(job, work)
        if not result.ok:
            _require_colcon()
        if result.stopped == "disk":  # too much to count is too much to read
            tempdir.remove(work / "install")
            (work / "install").mkdir()
        removed = [] if job.trusted else install_tree.remove_unsafe_entries(work / "install", _INSTALL)
        facts = _facts(result, work / "install", job)
        if not job.trusted:
            removed += install_tree.remove_byte_code(work / "install")
            facts = _verified(facts, work, removed, job)
            install_tree.link_misplaced(work / "install", facts.package, facts.misplaced.values())
            _compile_modules(work / "install")
        for name in ("alone", "build"):
            tempdir.remove(work / name)
        (work / "build.json").write_text(evidence.to_json(facts))
        build_cache.write_checksum(work / "install")
        if result.timed_out or result.stopped or (job.trusted and not facts.ok):
            # A build that ran out of time or memory may succeed on a quieter day, and the kit's own interfaces once
            # the machine is repaired: keep both out of the cache.
            folder = folder.with_name(work.name + ".timeout")
        elif folder.exists():
            tempdir.remove(folder)
        work.rename(folder)
    finally:
        tempdir.remove(work)
    return Built(facts, folder / "install")


def _copy_sources(packages: Sequence[Path], target: Path) -> None:
    """Copy the packages into `target`, where only the content of what a build tree is made from decides its age."""
    for package in packages:
        shutil.copytree(package, target / package.name, symlinks=True, ignore=build_cache.not_source)
    for path in install_tree.regular_files(target):
        os.utime(path, (_TREE_TIME, _TREE_TIME) if _TREE_FILES.fullmatch(path.name) else None)


def _copy_build_tree(job: _Job, work: Path) -> None:
    """Copy the build tree for the sources in `work`, built first if the cache has none, into the folder `build` there.

    It is built from the files that decide its name, alone in a sandbox. So a package can leave no mark in it, whatever
    its build runs, but one that every package with the same files would leave.
    """
    alone = work / "alone"
    for name in ("src", "build", "install"):
        (alone / name).mkdir(parents=True)
    files = _tree_files(work / "src")
    if not any(file.suffix in _INTERFACES for file in files):
        return  # it would be built in no time
    for file in files:
        (alone / "src" / file.parent).mkdir(parents=True, exist_ok=True)
        shutil.copy2(work / "src" / file, alone / "src" / file)
    tree = job.cache / "trees" / build_cache.build_key(sorted((alone / "src").iterdir()))
    tree.parent.mkdir(parents=True, exist_ok=True)
    with build_cache.locked(tree.with_suffix(build_cache.LOCK)):
        if not build_cache.is_intact(tree):
            tempdir.remove(tree)
            result = _colcon(job, alone)  # fails where there is nothing to install, when all that takes time is done
            if result.timed_out or result.stopped or not any((alone / "build").glob("*/.ninja_log")):
                return
            install_tree.remove_unsafe_entries(alone / "build", _BUILD)
            (alone / "build").rename(tree)
            build_cache.write_checksum(tree)
        shutil.copytree(tree, work / "build", symlinks=True, dirs_exist_ok=True)


def _tree_files(source: Path) -> list[Path]:
    """Return the paths below `source` of the files of CMake's packages from which a build tree is made."""
    folders = [path.parent for path in source.glob("*/CMakeLists.txt")]
    files = (path for folder in folders for path in install_tree.regular_files(folder))
    return [path.relative_to(source) for path in files if _TREE_FILES.fullmatch(path.name)]


def _colcon(job: _Job, work: Path) -> sandbox.RunResult:
    ccache = job.cache / "ccache"
    ccache.mkdir(parents=True, exist_ok=True)
    environment = ros_env.environment(home=sandbox.HOME)
    # Without MAKEFLAGS colcon adds `-l` with the number of cores: on a busy machine no second compiler would start.
    jobs = len(os.sched_getaffinity(0))
    environment |= {"MAKEFLAGS": f"-j{jobs}", "CMAKE_BUILD_PARALLEL_LEVEL": f"{jobs}"}
    launchers = []
    if shutil.which("ccache"):
        environment |= {"CCACHE_DIR": _CCACHE, "CCACHE_NOHASHDIR": "1", "CCACHE_BASEDIR": "/ws", "CCACHE_NOSTATS": "1"}
        environment |= {} if job.trusted else {"CCACHE_READONLY": "1", "CCACHE_TEMPDIR": "/tmp"}
        launchers = [f"-DCMAKE_{language}_COMPILER_LAUNCHER=ccache" for language in ("C", "CXX")]
    cmake = [(work / "src" / file).read_text("latin") for file in _tree_files(work / "src") if file.suffix == ".txt"]
    again = ["--cmake-force-configure"] if any(map(_looks_at_files, cmake)) else []
    box = sandbox.Sandbox(
        read_only={work / "src": _SOURCE, ros_env.CMAKE_HOOK: "/ws/wheel_prefix.cmake"}
        | ({} if job.trusted else {ccache: _CCACHE}),
        writable={work / "build": _BUILD, work / "install": _INSTALL} | ({ccache: _CCACHE} if job.trusted else {}),
        environment=environment,
        cwd="/ws",
        trusted=job.trusted,
    )
    command = [
        "colcon", "--log-base", "/tmp/log", "build", "--base-paths", _SOURCE, "--build-base", _BUILD,
        "--install-base", _INSTALL, "--merge-install", "--event-handlers", "console_direct+", "status-",
        *again, "--cmake-args", "-G", "Ninja", "-DCMAKE_PROJECT_INCLUDE=/ws/wheel_prefix.cmake", "-DBUILD_TESTING=OFF",
        *launchers,
    ]  # fmt: skip

    def heard(log: str) -> None:
        if far := how_far(log):
            job.far(far)

    return sandbox.run(command, box, sandbox.Limits(wall_seconds=job.seconds), heard)


def _looks_at_files(cmake: str) -> bool:
    """Return whether a CMakeLists.txt may configure otherwise where files are that no build tree is made from."""
    code = _COMMENT.sub("", cmake)
    return not {name.lower() for name in _COMMAND.findall(code)} <= _DECLARE or bool(_FILE_TEST.search(code))


def _compile_modules(install: Path) -> None:
    """Add byte code to an install tree, where a node finds it and need not compile its modules: 20 ms of each start.

    It counts only for a module with the same content, whatever its time. In a sandbox: a text may crash the compiler.
    """
    box = sandbox.Sandbox(writable={install: _INSTALL}, environment=ros_env.environment(home=sandbox.HOME))
    command = ["python3", "-I", "-m", "compileall", "-q", "--invalidation-mode", "checked-hash"]
    sandbox.run([*command, f"{_INSTALL}/{ros_env.SITE_IN_PREFIX}"], box, sandbox.Limits(wall_seconds=60.0))


def _require_colcon() -> None:
    """Check that colcon itself runs on this machine: a build that failed without it says nothing about the package.

    Raises:
        GraderError: it does not run.
    """
    box = sandbox.Sandbox(environment=ros_env.environment(home=sandbox.HOME))
    tried = sandbox.run(["colcon", "build", "--help"], box)
    if not tried.ok:
        words = mark("colcon does not run on this machine: {why}. Run `make setup`, or `grader doctor`.")
        raise GraderError(say(words, why=_without_host_paths(tried.output).strip()[-300:]))


def _facts(result: sandbox.RunResult, install: Path, job: _Job) -> evidence.Build:
    package = install_tree.main_package(install, job.main, job.course)
    types = install_tree.interfaces_package(install, package, job.course)
    share = install / "share"
    shared = install_tree.regular_files(share / package) if package else ()
    interfaces = job.course.interfaces
    texts = {name: install_tree.interface_text(install, name, types) for name in interfaces}
    hashes = {name: install_tree.installed_hash(share, types, name) for name in interfaces}
    return evidence.Build(
        ok=result.ok and bool(package),
        cached=False,
        wall_seconds=round(result.wall_seconds, 1),
        exit_code=result.exit_code,
        timed_out=result.timed_out,
        log_tail=_without_host_paths(result.output)[-_LOG_TAIL:],
        package=package or job.main,
        types_package=types,
        stopped=result.stopped,
        executables=install_tree.programs(install / "lib" / package) if package else [],
        misplaced=install_tree.misplaced_nodes(install, package, job.course) if package else {},
        shared_files=sorted(str(path.relative_to(share / package)) for path in shared),
        type_hashes={name: found for name, found in hashes.items() if found},
        interface_texts={name: text for name, text in texts.items() if text},
    )


def _verified(facts: evidence.Build, work: Path, removed: list[evidence.Flag], job: _Job) -> evidence.Build:
    """Return the facts with everything checked against the text that was handed in, and with flags for tampering.

    The submission's build wrote the hashes beside the installed interfaces. A hash that is not that of the text is
    replaced by a sentence, so that it never passes for the contract's.
    """
    if not facts.ok:
        return replace(facts, flags=[*removed, *install_tree.tampering_flags(work / "install")])
    own = [install_tree.definitions(work / "src" / package.name) for package in job.packages]
    installed = {f"{name}.{name.partition('/')[0]}": text for name, text in facts.interface_texts.items()}
    # A definition that CMake generates is not in the source; then the installed text counts.
    texts = installed | {name: text for each in reversed(own) for name, text in each.items()}
    made = {facts.types_package: install_tree.generate(texts, facts.types_package, job.cache)}
    if facts.package not in made and own and own[0]:
        made[facts.package] = install_tree.generate(own[0], facts.package, job.cache)
    hashes, flags = {}, []
    for name, found in facts.type_hashes.items():
        if found == made[facts.types_package].hashes.get(name):
            hashes[name] = found
        else:
            hashes[name] = "the installed hash is not that of the text"
            words = f"the hash installed for {name} is not that of its text"
            flags.append(evidence.Flag("forged type", words, where=f"{name}.json"))
    if odd := install_tree.not_generated(work / "install", made):
        words = "the build put code among the types that ROS's tools do not make; nobody measures it there"
        concerns = ["what ran", "student tests", "mutation"]
        flags.append(evidence.Flag("forged type", words, where=", ".join(odd[:5]), concerns=concerns))
    tampering = install_tree.tampering_flags(work / "install")
    return replace(facts, type_hashes=hashes, flags=[*removed, *flags, *tampering])


def _without_host_paths(log: str) -> str:
    """Return a build's log without the paths of ROS and of Python, and without colcon's warnings about them."""
    lines = [line for line in log.splitlines() if "doesn't contain any 'local_setup.*' files" not in line]
    return "\n".join(lines).replace(str(ros_env.PREFIX), "<ros>")
