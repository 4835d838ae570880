"""I1: the package builds, and installs what ROS looks for."""

from pathlib import PurePosixPath

from grader.checks.build_log import find_error
from grader.checks.first_cause import behind, listing, sentence, shown_by
from grader.checks.judge import Failed, Judge
from grader.evidence import Kind, Reason
from grader.words import mark, say, some

_PROGRAMS_BY_CMAKE = mark("install(PROGRAMS ... DESTINATION lib/${PROJECT_NAME}), with the executable bit set")
_PROGRAMS_BY_SETUP = mark(
    "entry_points in setup.py: {entry}, and in setup.cfg [install] install_scripts=$base/lib/{package}"
)
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
        words = mark("It builds, as {build.package}; the assignment asks for {course.package}.")
        try_ = say(
            "everything else was graded under the name that it has; rename it all at once: in package.xml, "
            "CMakeLists.txt or setup.py, in imports and launch files, and the folders of that name"
        )
        raise Failed(say(words, build=build, course=judge.course), try_)


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
    build, nodes, package = judge.evidence.build, judge.course.nodes, judge.course.package
    missing = [name for name in nodes if name not in build.executables]
    if missing:
        found = ", ".join(build.executables) or say("nothing")
        seen = say("not installed: {missing}; installed: {found}", missing=", ".join(missing), found=found)
        if build.misplaced:
            where = ", ".join(f"{folder}/{name}" for name, folder in build.misplaced.items())
            words = mark("{where}: `ros2 run` looks in {home} (the trials ran them where they are)")
            seen = say(words, where=where, home=f"lib/{build.package}")
        entry = f"'{missing[0]} = {package}.{missing[0]}:main'"
        by_setup = say(_PROGRAMS_BY_SETUP, entry=entry, package=package)
        judge.share(1 - len(missing) / len(nodes), *_explained(judge, missing, seen, _PROGRAMS_BY_CMAKE, by_setup))


def test_shared_files_are_installed(judge: Judge) -> None:
    """The contract's files of the package's share folder are installed there."""
    judge.require_build()
    shared = judge.course.shared
    # Anywhere in it: `ros2 launch` looks through the whole folder.
    missing = [name for name in shared if not judge.is_installed(name)]
    if missing:
        kinds = {PurePosixPath(name).suffix for name in shared}
        others = [path for path in judge.evidence.build.shared_files if PurePosixPath(path).suffix in kinds]
        found = some(others) or say("no launch or config file")
        seen = say("not installed: {missing}; installed: {found}", missing=", ".join(missing), found=found)
        share = 1 - len(missing) / len(shared)
        judge.share(share, *_explained(judge, missing, seen, _SHARED_BY_CMAKE, _SHARED_BY_SETUP))


def _explained(judge: Judge, missing: list[str], seen: str, by_cmake: str, by_setup: str) -> tuple[str, str]:
    """Return `seen` with what the package's text shows of it, and what to try where it is built as this one is."""
    if unwritten := judge.unwritten(missing):
        seen = say("{seen}\nnot in the package: {which}", seen=seen, which=", ".join(unwritten))
        return seen, say("write these files, then install their folders")
    if cause := behind(judge.faults("install"), missing):
        return f"{seen}\n{sentence(cause)}", cause.cure
    return seen, by_setup if judge.installer == "setup.py" else by_cmake
