"""The `ros2` command without a graph: packages, interfaces, `run`, and what is refused."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from helpers import until
from helpers.archives import write
from helpers.ros2_runs import COMMAND, environment

from grader.host import ros_env


def test_an_interface_is_shown_with_the_types_of_its_fields(ros2):
    shown = ros2("interface", "show", "geometry_msgs/msg/TwistStamped")
    assert shown.stdout == (
        "# A twist with reference coordinate frame and timestamp\n\nstd_msgs/Header header\n"
        "\tbuiltin_interfaces/Time stamp\n\t\tint32 sec\n\t\tuint32 nanosec\n\tstring frame_id\n"
        "Twist twist\n"
        "\tVector3  linear\n\t\tfloat64 x\n\t\tfloat64 y\n\t\tfloat64 z\n"
        "\tVector3  angular\n\t\tfloat64 x\n\t\tfloat64 y\n\t\tfloat64 z\n"
    )
    assert "# informational, e.g. for error messages" in ros2("interface", "show", "std_srvs/srv/SetBool").stdout


@pytest.mark.parametrize(
    ("words", "code", "out", "err"),
    [
        (["interface", "show", "std_msgs/String"], 1, "", "Invalid name 'std_msgs/String'. Expected three parts"),
        (["interface", "show", "std_msgs/msg/Nope"], 1, "", "Could not find the interface '"),
        (["interface", "package", "nope"], 1, "", "Unknown package 'nope'"),
        (["pkg", "prefix", "nope"], 1, "", "Package 'nope' not found"),
        (["pkg", "executables", "nope"], 1, "", "Package 'nope' not found"),
        (["run", "nope", "nope"], 1, "", "Package 'nope' not found"),
        (["run", "demo", "nope"], 1, "", "No executable found. demo has counting, fail, family, show, stubborn, wait"),
        (["run", "demo", "show", "--x", "1"], 0, "ARGV --x 1\n", ""),
        (["run", "demo", "fail"], 3, "[ros2run]: Process exited with failure 3\n", ""),
        (["interface", "proto", "std_srvs/srv/SetBool"], 0, '"data: false\n"\n', ""),
        (["nope"], 2, "", "invalid choice: 'nope'"),
        (["topc", "list"], 2, "", "\nDid you mean topic?"),
        (["topic", "lst"], 2, "", "\nDid you mean list?"),
        (["run", "dmo", "show"], 1, "", "Package 'dmo' not found\nDid you mean demo?"),
        (["interface", "show", "std_msgs/Strin"], 1, "", "separated by '/'\n"),
        (["interface", "show", "std_msgs/String"], 1, "", "separated by '/'\nDid you mean std_msgs/msg/String?"),
        (["interface", "show", "std_msgs/msg/Strin"], 1, "", "\nDid you mean std_msgs/msg/String?"),
        (["service", "call", "/s", "std_srvs/srv/SetBool", "data:", "true"], 2, "", "go in quotes, as one word"),
        (["bag", "info", "."], 1, "", "Could not read bag '.': it has no metadata.yaml"),
        (["daemon", "stop"], 2, "", "ros2 daemon: not available; there is no daemon"),
        (["doctor"], 2, "", "ros2 doctor: not available; type `make doctor`"),
        (["topic", "bw", "/scan"], 2, "", "ros2 topic bw: not available; use `ros2 topic hz`"),
        (["bag", "play", "-l", "."], 2, "", "unrecognized arguments: -l"),
        (
            ["pkg", "create", "--build-type", "ament_python", "Bad-Name"],
            1,
            "",
            "Package name 'Bad-Name' is not allowed",
        ),
    ],
)
def test_output_and_exit_code(ros2, words, code, out, err):
    done = ros2(*words)
    assert done.returncode == code
    assert done.stdout.startswith(out)
    assert err in done.stderr


def test_packages_executables_and_interfaces_are_listed(ros2, demo):
    assert ros2("pkg", "executables", "demo").stdout.splitlines()[0] == "demo counting"
    assert ros2("pkg", "prefix", "demo").stdout == f"{demo}\n"
    assert {"demo", "rclpy", "std_msgs"} <= set(ros2("pkg", "list").stdout.split())
    assert set(ros2("interface", "package", "std_srvs").stdout.split()) == {
        f"std_srvs/srv/{name}" for name in ("Empty", "SetBool", "Trigger")
    }


SETUP = COMMAND / "setup.bash"


def workspace_with_mine(root: Path, *, built: bool) -> Path:
    """Lay out a workspace with the package `mine`; a failed build leaves its prefix too, without the marker."""
    files = ["src/mine/package.xml", "install/setup.bash", "install/mine/share/mine/package.sh"]
    files += ["install/mine/share/ament_index/resource_index/packages/mine"] if built else []
    return write(root, dict.fromkeys(files, ""))


@pytest.mark.parametrize("inside", ["", "ws"], ids=["here", "in ws, as from the kit's folder"])
def test_a_package_that_is_not_sourced_or_whose_build_failed_is_found_nearby(ros2, tmp_path, inside):
    workspace = workspace_with_mine(tmp_path / inside, built=False)
    assert ros2("run", "mine", "x").stderr == (
        f"Package 'mine' not found\nIt is not built yet; its source is in {workspace}/src: "
        f"source {SETUP} && cd {workspace} && colcon build && source install/setup.bash\n"
    )
    workspace_with_mine(workspace, built=True)
    assert ros2("run", "mine", "x").stderr == (
        f"Package 'mine' not found\nIt is built in {workspace}, but not sourced in this terminal: "
        f"source {SETUP} && source {workspace}/install/setup.bash\n"
    )


def test_a_prepared_terminal_is_not_told_to_prepare_itself(ros2, tmp_path):
    workspace_with_mine(tmp_path, built=True)
    said = ros2("run", "mine", "x", CMAKE_TOOLCHAIN_FILE="wheels.cmake", SHELL="/usr/bin/zsh").stderr
    assert said.splitlines()[1].endswith(f"this terminal: source {tmp_path}/install/setup.zsh")


@pytest.mark.slow  # a start of pytest, and a build with colcon
def test_a_new_package_passes_its_own_tests_and_builds(ros2, tmp_path):
    made = ros2("pkg", "create", "--build-type", "ament_python", "--license", "Apache-2.0", "my_pkg")
    assert "creating ./my_pkg/my_pkg/__init__.py\n" in made.stdout

    def run(folder: Path, *words: str) -> str:
        env = {**environment(Path(sys.prefix), tmp_path), "CMAKE_PREFIX_PATH": sys.prefix}
        return subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, check=False).stdout

    tests = run(tmp_path / "my_pkg", sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert "2 passed, 1 skipped" in tests
    again = ros2("pkg", "create", "--build-type", "ament_python", "my_pkg")
    assert again.returncode == 1
    assert "The directory already exists" in again.stderr
    said = run(tmp_path, "colcon", "build", "--event-handlers", "console_direct-")
    assert (tmp_path / "install/my_pkg/share/my_pkg/package.xml").is_file(), said


@pytest.mark.ros
def test_sigint_ends_a_command_in_the_background_of_a_script(demo, tmp_path):
    """A shell starts what stands before an `&` with SIGINT ignored; `kill -INT` must end it all the same."""
    env = {**environment(demo, tmp_path), **ros_env.environment(home=tmp_path)}
    echo = [sys.executable, str(COMMAND), "topic", "echo", "/nothing", "std_msgs/msg/String"]
    with subprocess.Popen(echo, env=env, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)) as process:
        # Before the command has set its own handler, the signal is ignored: so again and again.
        try:
            until(lambda: process.send_signal(signal.SIGINT) or process.poll() is not None)
        finally:
            process.kill()
    assert process.returncode in (2, -signal.SIGINT)
