"""I1: the package builds, and installs what ROS looks for."""

from collections.abc import Mapping
from pathlib import PurePosixPath

from grader.checks.build_log import find_error
from grader.checks.first_cause import behind, listing, sentence, shown_by
from grader.checks.judge import Failed, Judge
from grader.course import Course
from grader.evidence import Kind, Reason
from grader.words import mark, say, some

_PROGRAMS_BY_CMAKE = mark("install(PROGRAMS ... DESTINATION lib/${PROJECT_NAME}), with the executable bit set")
_SHARED_BY_CMAKE = mark("install(DIRECTORY launch config DESTINATION share/${PROJECT_NAME})")
_SHARED_BY_SETUP = mark("data_files in setup.py: (os.path.join('share', package_name, 'launch'), glob('launch/*'))")


def test_colcon_build_succeeds(judge: Judge) -> None:
    """`colcon build` succeeds."""
    build = judge.evidence.build
    if build.timed_out:
        seen = say("colcon build ran out of time after {build.wall_seconds:.0f} s", build=build)
        try_ = say("run `colcon build`: does it end? If it does, grade again with a longer --build-timeout")
        raise Failed(seen, try_, Reason(Kind.NOT_BUILT))
    if not build.ok:
        raise Failed(*_first_cause(judge), Reason(Kind.NOT_BUILT))
    if build.package != judge.course.package:
        seen = say(
            "It builds, as {build.package}; the assignment asks for {course.package}.", build=build, course=judge.course
        )
        try_ = say(
            "everything else was graded under the name that it has; rename it all at once: in package.xml, "
            "CMakeLists.txt or setup.py, in imports and launch files, and the folders of that name"
        )
        raise Failed(seen, try_)


def _first_cause(judge: Judge) -> tuple[str, str]:
    """Return what stopped the build and what to do about it: by the package's text, or else by the build's log."""
    log = judge.evidence.build.log_tail
    how = say("colcon build ended with exit status {judge.evidence.build.exit_code}", judge=judge)
    if judge.evidence.build.exit_code == 0:
        how = say("colcon build ended, and installed no package")
    error = find_error(log)
    faults = judge.faults("build")
    # A build that ends well shows nothing of what it left out.
    cause = shown_by(faults, log) or (faults[0] if faults and not error.said else None)
    others = [fault for fault in judge.faults("build", "install", "start") if fault != cause]
    if cause is not None:
        said = f": {error.said}" if error.said and cause.text not in error.said else ""
        lead, try_ = f"{sentence(cause)}\n{how}{said}", cause.cure
    else:
        lead = f"{how}: {error.said}" if error.said else how
        try_ = error.cure or say("run `colcon build` and read its first error, not its last")
    return "\n".join(filter(None, [lead, listing(others, say("its text shows besides:"))])), try_


def test_executables_are_installed(judge: Judge) -> None:
    """Both executables are installed where `ros2 run` looks: lib/<package>/."""
    judge.require_build()
    found = judge.evidence.build.executables
    nodes = judge.course.nodes
    missing = [name for name in nodes if name not in found]
    if missing:
        share = 1 - len(missing) / len(nodes)
        if misplaced := judge.evidence.build.misplaced:
            judge.share(share, *_misplaced(judge, misplaced))
            return
        seen = say(
            "not installed: {missing}; installed: {found}",
            missing=", ".join(missing),
            found=", ".join(found) or say("nothing"),
        )
        judge.share(share, *_explained(judge, missing, seen, _PROGRAMS_BY_CMAKE, _programs_by_setup(judge.course)))


def _programs_by_setup(course: Course) -> str:
    node, package = next(iter(course.nodes)), course.package
    entry = f"'{node} = {package}.{node}:main'"
    return say(
        "entry_points in setup.py: {entry}, and in setup.cfg [install] install_scripts=$base/lib/{package}",
        entry=entry,
        package=package,
    )


def _misplaced(judge: Judge, folders: Mapping[str, str]) -> tuple[str, str]:
    """Return where the nodes are instead, and what to try where the package is built as this one is."""
    intake, package = judge.evidence.intake, judge.evidence.build.package
    home = f"lib/{package}"
    where = [f"{folder}/{name}" for name, folder in folders.items()]
    seen = say(
        "{where}: `ros2 run` looks in {home} (the trials ran them where they are)", where=", ".join(where), home=home
    )
    if f"{intake.package_path}/CMakeLists.txt".removeprefix("./") in intake.files:
        return seen, say("install(PROGRAMS ... DESTINATION lib/${PROJECT_NAME})")
    lines = say("[develop] script_dir=$base/{home} and [install] install_scripts=$base/{home}", home=home)
    return seen, say("setup.cfg beside setup.py says where: {lines}", lines=lines)


def test_shared_files_are_installed(judge: Judge) -> None:
    """The contract's files of the package's share folder are installed there."""
    judge.require_build()
    found = judge.evidence.build.shared_files
    shared = judge.course.shared
    # Anywhere in it: `ros2 launch` looks through the whole folder.
    missing = [name for name in shared if not judge.is_installed(name)]
    if missing:
        names = {PurePosixPath(name).name for name in shared}
        others = [f for f in found if f.startswith(("launch/", "config/")) or PurePosixPath(f).name in names]
        seen = say(
            "not installed: {missing}; installed: {others}",
            missing=", ".join(missing),
            others=some(others) or say("no launch or config file"),
        )
        share = 1 - len(missing) / len(shared)
        judge.share(share, *_explained(judge, missing, seen, _SHARED_BY_CMAKE, _SHARED_BY_SETUP))


def _explained(judge: Judge, missing: list[str], seen: str, by_cmake: str, by_setup: str) -> tuple[str, str]:
    """Return `seen` with what the package's text shows of it, and what to try where it is built as this one is."""
    cause = behind(judge.faults("install"), missing)
    if unwritten := judge.unwritten(missing):
        which = say("all of these") if len(unwritten) > 1 and unwritten == missing else ", ".join(unwritten)
        return say("{seen}\nnot in the package: {which}", seen=seen, which=which), say(
            "write these files, then install their folders"
        )
    if cause is not None:
        return f"{seen}\n{sentence(cause)}", cause.cure
    return seen, by_setup if judge.installer == "setup.py" else by_cmake
