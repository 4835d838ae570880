"""Nodes that are forked from a process which has imported rclpy are what Python would have started, each by itself."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import helpers
import pytest

from grader import sandbox
from grader.host import namespaces, ros_env
from grader.sandbox.first_process import MODULES
from grader.trials.node_server import ForkedNode, NodeServer, can_fork, node_environment

pytestmark = pytest.mark.skipif(
    namespaces.confinement() is not namespaces.Confinement.NAMESPACES, reason="needs namespaces"
)
LIMITS = sandbox.Limits()
PROGRAM = "lib/p/node"


@pytest.fixture(scope="module")
def install(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("forked")
    folder.chmod(0o755)
    (folder / "install" / "lib" / "p").mkdir(parents=True)
    (folder / "install" / ros_env.SITE_IN_PREFIX).mkdir(parents=True)
    (folder / "install" / ros_env.SITE_IN_PREFIX / "p.py").write_text("def fail():\n    raise ValueError('of p')\n")
    return folder / "install"


@pytest.fixture(scope="module")
def server(install: Path) -> Iterator[NodeServer]:
    with closing(NodeServer(install, install.parent, LIMITS)) as started:
        assert started.works
        yield started


@pytest.fixture
def run(install: Path, server: NodeServer) -> Iterator[Callable[..., ForkedNode]]:
    """Start a program as a node, with its arguments; wait for its end, or for `until` in its output."""

    def started(program: str, *arguments: str, until: str = "") -> ForkedNode:
        (install / PROGRAM).write_text("#!/usr/bin/env python3\n" + textwrap.dedent(program))
        server.notes.begin(functions=True)
        node = server.start([f"/ws/install/{PROGRAM}", *arguments], node_environment() | {"ROS_DOMAIN_ID": "7"})
        helpers.until(lambda: node.has_ended() or (until and until in node.output))
        return node

    yield started
    assert server.clear()
    assert not server.process.pids()


def test_a_fork_is_the_program_that_python_would_start(run):
    node = run(
        """
        import json, os, sys, __main__
        from p import fail
        print(json.dumps({
            "name": __name__, "file": __file__, "main": __main__.run.__module__ if hasattr(__main__, "run") else "",
            "arguments": sys.argv, "first": sys.path[:2], "domain": os.environ["ROS_DOMAIN_ID"],
            "loaded": "rclpy" in sys.modules, "kit": "grader" in sys.modules, "input": sys.stdin.read(),
        }))
        """,
        "--ros-args",
    )
    told = json.loads(node.output)
    program = f"/ws/install/{PROGRAM}"
    assert (told["name"], told["file"], told["arguments"]) == ("__main__", program, [program, "--ros-args"])
    assert told["first"] == ["/ws/install/lib/p", "/ws/at_start"]
    assert (told["domain"], told["loaded"], told["kit"], told["input"]) == ("7", True, False, "")
    assert node.exit_code() == 0


def test_all_that_is_there_by_then_is_known(run):
    node = run("import sys; print(*{name.partition('.')[0] for name in sys.modules} - set(sys.stdlib_module_names))")
    known = {name.partition(".")[0] for name in MODULES}
    others = {name for name in node.output.split() if not name.startswith(("_", "__editable__"))} - known
    assert others <= {"sitecustomize", "cython_runtime", "ros_wheels_bootstrapper"}


@pytest.mark.parametrize(
    ("program", "code"),
    {"import sys; sys.exit(3)": 3, "import os; os.abort()": -6, "raise SystemExit": 0, "import threading": 0}.items(),
)
def test_its_exit_code_is_known(run, program: str, code: int):
    assert run(program).exit_code() == code


def test_a_traceback_shows_the_package_alone_and_comes_whole(run):
    node = run("print('x' * 300_000, end='')\nfrom p import fail\nfail()")
    assert node.exit_code() == 1
    text = node.output.removeprefix("x" * 300_000)
    assert [line.split('"')[1] for line in text.splitlines() if '"' in line] == [
        f"/ws/install/{PROGRAM}", f"/ws/install/{ros_env.SITE_IN_PREFIX}/p.py",
    ]  # fmt: skip
    assert text.startswith("Traceback (most recent call last):\n")
    assert text.endswith("ValueError: of p\n")


def test_ctrl_c_reaches_it_and_an_abort_shows_where_it_is(run, server: NodeServer):
    waits = "import time\nprint('up', flush=True), time.sleep(60)"  # one line, wherever it is met
    node = run(waits, until="up")
    assert node.exit_code() is None
    node.interrupt()
    helpers.until(node.has_ended)
    assert (node.exit_code(), node.output.splitlines()[-1]) == (-2, "KeyboardInterrupt")
    assert server.clear()
    node = run(waits, until="up")
    node.abort()
    helpers.until(node.has_ended)
    assert node.exit_code() == -6
    assert "line 3 in <module>" in node.output


def test_the_next_one_finds_nothing_of_the_one_before(run, server: NodeServer):
    leaves = """
        import os, subprocess
        open("/tmp/left", "w").close(), open(os.path.expanduser("~/left"), "w").close()
        subprocess.Popen(["sleep", "60"], start_new_session=True)
        print("left", flush=True)
    """
    run(leaves)
    assert server.clear()
    looks = """
        import os
        print("left" in [*os.listdir("/tmp"), *os.listdir(os.path.expanduser("~"))], os.listdir("/proc").count("1"))
        print([name for name in os.listdir("/proc") if name.isdigit() and int(name) not in (1, os.getpid())])
    """
    assert run(looks).output == "False 1\n[]\n"


def test_no_node_reads_or_stops_the_process_that_forks(run, server: NodeServer):
    node = run(
        """
        import os, signal
        for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGABRT):
            os.kill(1, number)
        for name in ("mem", "environ", "fd/0"):
            try:
                open(f"/proc/1/{name}").read(1)
            except PermissionError:
                print("denied")
        """
    )
    assert node.output == "denied\n" * 3
    assert server.clear()


def test_what_runs_in_a_fork_is_noted(run, server: NodeServer):
    node = run("from p import fail\nimport time\nprint('up', flush=True)\ntime.sleep(60)", until="up")
    server.notes.look_at(node.pids())
    ran = server.notes.read(node_is_up=True)
    assert ran is not None
    assert (sorted(ran.functions), ran.unseen) == ([PROGRAM, f"{ros_env.SITE_IN_PREFIX}/p.py"], [])


@pytest.mark.parametrize("hook", ["/ws/at_start", ""])
def test_another_process_that_forks_hides_nothing(run, server: NodeServer, hook: str):
    """The node starts it as the grader does, where no hook sees that, and asks it for a program nobody handed in."""
    node = run(
        f"""
        import ctypes, json, os, subprocess
        open("/tmp/other.py", "w").write("import time; print('other', flush=True); time.sleep(60)")
        asked, ask = os.pipe()
        request = {{"command": ["/tmp/other.py"], "environment": {{"PYTHONPATH": ""}}}}
        os.write(ask, json.dumps(request).encode() + b"\\n")
        path, started = b"PYTHONPATH={hook}", open("/proc/self/environ", "rb").read()
        variables = started.replace(b"PYTHONPATH=/ws/at_start", path).rstrip(b"\\0").split(b"\\0")
        if os.fork() == 0:
            os.dup2(asked, 0)
            words = [b"python3", b"/ws/first/fork_nodes.py"]
            arrays = [(ctypes.c_char_p * (len(each) + 1))(*each, None) for each in (words, variables)]
            ctypes.CDLL(None).execve(os.readlink("/proc/self/exe").encode(), *arrays)
        os.wait()
        """,
        until="other",
    )
    server.notes.look_at(node.pids())
    ran = server.notes.read(node_is_up=True)
    assert ran is not None
    assert any("/tmp/other.py" in words or words.startswith("notes turned off") for words in ran.unseen)


@pytest.mark.parametrize(
    ("program", "module", "can"),
    [
        ("#!/usr/bin/env python3\n", "p", True),
        ("#!/opt/venv/bin/python3.12\n", "p", True),
        ("#!/usr/bin/env python3\n", "rclpy", False),
        ("#!/usr/bin/env python3\n", "numpy.py", False),
        ("#!/usr/bin/env python3\n", "usercustomize.py", False),
        ("#!/usr/bin/env python3\n", "queue", False),
        ("#!/usr/bin/python3 -I\n", "p", False),
        ("#!/bin/sh\n", "p", False),
        ("\x7fELF", "p", False),
    ],
)
def test_what_is_no_plain_python_or_brings_a_module_of_these_is_started_by_itself(
    tmp_path: Path, program: str, module: str, can: bool
):
    (tmp_path / ros_env.SITE_IN_PREFIX / module).mkdir(parents=True)
    (tmp_path / "node").write_text(program)
    assert can_fork(tmp_path, tmp_path / "node") is can
    assert not can_fork(tmp_path, tmp_path / "missing")


def test_a_server_that_cannot_start_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    tmp_path.chmod(0o755)
    monkeypatch.setattr("grader.trials.node_server.COMMAND", ("false",))
    with closing(NodeServer(tmp_path, tmp_path, LIMITS)) as started:
        assert not started.works
