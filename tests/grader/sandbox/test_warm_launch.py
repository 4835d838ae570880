"""A launch that is forked starts nodes as forks, and they see, may and do the same as those that a launch starts."""

from __future__ import annotations

import json
import os
import re
import signal
import textwrap
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from helpers.programs import ABOUT_ITSELF, ENDS_WITH_MANY_STACKS, INSTALL, LIMITS, await_output, box, ended, write

from grader import KIT, sandbox
from grader.sandbox.warm_start import WarmPython

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # some thirty launches

Launch = Callable[..., sandbox.Process]

HOWS = ("cold", "warm")
FORKED = "import sys; print('forked' if 'rclpy' in sys.modules else 'started')"
WAITS_FOR_CTRL_C = """
    import time
    try:
        print("up", flush=True)
        time.sleep(600)
    except KeyboardInterrupt:
        print("bye")
"""
PARENT = """
    import os
    with open(f"/proc/{os.getppid()}/cmdline") as stream:
        print("/ws/ros2" in stream.read(), os.getsid(0) == os.getpid() == os.getpgid(0))
"""
LAUNCH_FILE = """
    from launch import LaunchDescription
    from launch.actions import ExecuteProcess, SetEnvironmentVariable

    def generate_launch_description():
        return LaunchDescription([{actions}])
"""
NODE = f"ExecuteProcess(cmd=['{INSTALL}/lib/pkg/node', 'a', 'b c'], output='screen')"


@pytest.fixture
def launch(install: Path, warm: WarmPython) -> Iterator[Launch]:
    """Return what runs a launch file, "cold" or "warm", with these actions and this text of the node."""
    running: list[sandbox.Process] = []

    def run(how: str, node: str, actions: str = NODE) -> sandbox.Process:
        write(install, node)
        (install / "any_launch.py").write_text(textwrap.dedent(LAUNCH_FILE).format(actions=actions))
        own = box(install)
        with_ros2 = sandbox.Sandbox(
            {**own.read_only, KIT / "grader" / "ros2": "/ws/ros2"}, environment=own.environment, network=True
        )
        command = [*sandbox.LAUNCH, f"{INSTALL}/any_launch.py"]
        assert warm.suits(command, with_ros2)
        running.append(sandbox.Process(command, with_ros2, LIMITS, warm if how == "warm" else None))
        return running[-1]

    yield run
    for process in running:
        process.kill()


def said(process: sandbox.Process) -> str:
    """Return what the node printed and how it ended, as the launch tells it, without what differs in each launch."""
    _, output = ended(process)
    return re.sub(r"pid \[?\d+\]?|[\d-]{20,}|0x[0-9a-f]+", "N", "".join(output.splitlines(keepends=True)[2:]))


def test_its_nodes_are_forks(launch: Launch):
    assert "[node-1] started\n" in said(launch("cold", FORKED))
    assert "[node-1] forked\n" in said(launch("warm", FORKED))


def test_a_node_learns_the_same_of_itself(launch: Launch):
    cold, warm = (json.loads(re.findall(r"\[node-1\] ({.*})", said(launch(how, ABOUT_ITSELF)))[0]) for how in HOWS)
    assert warm == cold


@pytest.mark.parametrize(
    "text",
    [
        "print('said', flush=True)",
        "import sys; print('to stderr', file=sys.stderr); sys.exit(3)",
        "raise RuntimeError('why')",
        "import os; os.kill(os.getpid(), 9)",
        "import ctypes, faulthandler; faulthandler.disable(); ctypes.string_at(0)",
        "import faulthandler, os; faulthandler.disable(); os.abort()",
        "import os; os._exit(255)",
        ENDS_WITH_MANY_STACKS,
        "this is not Python",
    ],
)
def test_a_node_ends_in_the_same_way(launch: Launch, text: str):
    cold, warm = (said(launch(how, text)) for how in HOWS)
    assert "[node-1]" in cold
    assert warm == cold


@pytest.mark.parametrize("how", HOWS)
def test_a_node_is_the_launchs_own_child_and_leads_a_session(launch: Launch, how: str):
    assert "[node-1] True True\n" in said(launch(how, PARENT))


def test_what_nodes_are_forked_from_is_closed_to_them(launch: Launch):
    """Else a node could rewrite it, and so the nodes after it."""
    text = """
        import os
        def opens(pid):
            try:
                return open(f"/proc/{pid}/mem", "r+b").close() is None
            except OSError:
                return False
        pids = [int(name) for name in os.listdir("/proc") if name.isdigit()]
        parents = {pid: int(open(f"/proc/{pid}/stat").read().rpartition(")")[2].split()[1]) for pid in pids}
        print(opens(os.getpid()), opens(min(pid for pid in pids if parents[pid] == os.getppid())))
    """
    assert "[node-1] True False\n" in said(launch("warm", text))


@pytest.mark.parametrize("how", HOWS)
def test_ctrl_c_reaches_the_node(launch: Launch, how: str):
    process = launch(how, WAITS_FOR_CTRL_C)
    await_output(process, "up\n")
    process.interrupt()
    code, output = ended(process)
    assert "[node-1] bye\n" in output
    assert "[INFO] [node-1]: process has finished cleanly" in output
    assert code == 0


@pytest.mark.parametrize("how", HOWS)
def test_no_node_outlives_its_launch(launch: Launch, how: str):
    process = launch(how, "import os, time; print('up', flush=True); time.sleep(600)")
    await_output(process, "up")
    inside = [pid for pid in process.pids() if "lib/pkg/node" in command_line(pid)]
    assert inside
    (of_launch,) = {parent_of(pid) for pid in inside}
    os.kill(of_launch, signal.SIGKILL)
    deadline = time.monotonic() + 60.0
    while any("lib/pkg/node" in command_line(pid) for pid in inside):
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("actions", "expected"),
    [
        (f"SetEnvironmentVariable('PYTHONOPTIMIZE', '1'), {NODE}", "started"),
        (NODE.replace("output=", "shell=True, output="), "started"),
        (NODE.replace("output=", "emulate_tty=True, output="), "started"),
        (NODE.replace("output=", "cwd='/', output="), "forked"),
        (f"{NODE}, {NODE}", "forked"),
    ],
)
def test_a_node_that_would_differ_is_started(launch: Launch, actions: str, expected: str):
    found = re.findall(r"(forked|started)\r?\n", said(launch("warm", FORKED, actions)))
    assert set(found) == {expected}


def test_a_node_beside_a_module_that_is_loaded_already_is_started(launch: Launch, install: Path):
    (install / "lib" / "pkg" / "yaml.py").touch()
    assert "[node-1] started\n" in said(launch("warm", FORKED))


@pytest.mark.parametrize(
    "junk",
    ["send(b'')", "send(b'no JSON')", "send(b'{}')", "shutdown(2)", "close()"],
    ids=lambda junk: junk.split("(")[0],
)
def test_a_launch_file_that_spoils_the_channel_harms_its_own_nodes_only(launch: Launch, junk: str):
    actions = f"[__import__('ros2kit').launching.forked._CHANNEL.{junk}, {NODE}][1]"
    code, _ = ended(launch("warm", FORKED, actions))
    assert code is not None


def command_line(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""


def parent_of(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
