"""I1: the package builds, and installs what ROS looks for."""

from grader.checks.build_log import first_error
from grader.checks.judge import Failed, Judge
from grader.contract.spec import NODES

_SHARED = (
    "launch/robot_controller_launch.py",
    "launch/sensor_processor_launch.py",
    "config/robot_params.yaml",
    "config/sensor_params.yaml",
)


def test_colcon_build_succeeds(judge: Judge) -> None:
    """`colcon build` succeeds."""
    build = judge.evidence.build
    if not build.ok:
        how = "ran out of time" if build.timed_out else f"ended with exit status {build.exit_code}"
        error = first_error(build.log_tail)
        said = f": {error}" if error else ""
        try_ = "run `colcon build` and read its first error, not its last"
        if build.timed_out:
            said = f" after {build.wall_seconds:.0f} s"
            try_ = "run `colcon build`: does it end? If it does, grade again with a longer --build-timeout"
        raise Failed(f"colcon build {how}{said}", try_)


def test_executables_are_installed(judge: Judge) -> None:
    """Both executables are installed where `ros2 run` looks: lib/<package>/."""
    judge.require_build()
    found = judge.evidence.build.executables
    missing = [name for name in NODES if name not in found]
    if missing:
        seen = f"missing: {', '.join(missing)}; found: {', '.join(found) or 'nothing'}"
        share = 1 - len(missing) / len(NODES)
        judge.share(share, seen, "install(PROGRAMS ... DESTINATION lib/${PROJECT_NAME}), with the executable bit set")


def test_launch_and_config_are_installed(judge: Judge) -> None:
    """Launch and config files are installed in the package's share folder."""
    judge.require_build()
    found = judge.evidence.build.shared_files
    missing = [name for name in _SHARED if name not in found]
    if missing:
        others = [name for name in found if name.startswith(("launch", "config"))]
        seen = f"missing: {', '.join(missing)}; found: {', '.join(others) or 'no launch or config file'}"
        share = 1 - len(missing) / len(_SHARED)
        judge.share(share, seen, "install(DIRECTORY launch config DESTINATION share/${PROJECT_NAME})")
