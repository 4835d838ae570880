"""A program that is forked into its sandbox sees, may and does the same as one that Python was started for."""

from __future__ import annotations

import ctypes
import json
import os
import re
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from helpers.programs import ABOUT_ITSELF, ENDS_WITH_MANY_STACKS, ENVIRONMENT, LIMITS, await_output, box, ended, write

from grader import KIT, sandbox
from grader.host import cgroup, procfs, ros_env
from grader.sandbox import warm_imports
from grader.sandbox.warm_start import CannotFork, WarmPython

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]

Start = Callable[[str, str], sandbox.Process]


@pytest.fixture
def start(install: Path, warm: WarmPython) -> Iterator[Start]:
    """Return what starts a program, "cold" or "warm"."""
    running: list[sandbox.Process] = []

    def start(how: str, text: str) -> sandbox.Process:
        command = write(install, text)
        assert warm.suits(command, box(install))
        running.append(sandbox.Process(command, box(install), LIMITS, warm if how == "warm" else None))
        return running[-1]

    yield start
    for process in running:
        process.kill()


def test_a_program_learns_the_same_of_itself(start: Start):
    (cold_code, cold), (warm_code, forked) = ended(start("cold", ABOUT_ITSELF)), ended(start("warm", ABOUT_ITSELF))
    assert cold_code == warm_code == 0, forked
    assert json.loads(forked) == json.loads(cold)


# Imports the modules that docs/trials.md lists, and imports and uses all that is loaded for nodes.
LISTED = (KIT / "docs" / "trials.md").read_text().partition("what forks it needs itself: ")[2].partition("\n")[0]
MODULES = f"""
    import importlib, json, os, sys
    before = sorted(sys.modules)
    for name in {(*warm_imports.MODULES, *re.findall("`(.+?)`", LISTED))}:
        importlib.import_module(name)
    from rclpy.type_support import check_for_type_support
    for package, names in {warm_imports.TYPES}.items():
        for name in names:
            check_for_type_support(getattr(sys.modules[package], name))
    print(json.dumps([before, sorted(sys.modules), len(os.listdir("/proc/self/task"))]))
"""
# "Am I under test?", asked of sys.modules.
OF_TESTS = {"unittest", "doctest", "pytest", "_pytest", "py", "pluggy", "coverage", "mock", "nose", "hypothesis"}


def test_no_program_takes_itself_for_one_under_test(start: Start):
    """unittest.mock was in a node's sys.modules in trials, and on no robot."""
    before, _, _ = json.loads(ended(start("warm", MODULES))[1])
    assert {name.split(".")[0] for name in before} & OF_TESTS == set()


def test_a_node_has_the_modules_and_threads_of_one_that_was_started(start: Start):
    (_, cold), (_, forked) = ended(start("cold", MODULES)), ended(start("warm", MODULES))
    assert json.loads(forked)[1:] == json.loads(cold)[1:]


@pytest.mark.slow  # many threads
def test_it_exits_as_well_when_many_threads_have_ended(start: Start):
    """Demonstrations that had done all they should ended with -11, and lost a point of Q6."""
    assert ended(start("warm", ENDS_WITH_MANY_STACKS)) == (0, "done\n")


def test_it_has_no_rights(start: Start):
    _, output = ended(start("warm", ABOUT_ITSELF))
    found = json.loads(output)
    rights = [value for name, value in found["status"].items() if name.startswith("Cap")]
    assert rights == ["0" * 16] * 4
    assert (found["status"]["NoNewPrivs"], found["status"]["Seccomp"]) == ("1", "2")
    assert not found["is root"] or os.geteuid() != 0


# add_key, request_key, keyctl, userfaultfd, io_uring's three; ptrace, process_vm_readv and _writev, pidfd_getfd.
REFUSED = dict.fromkeys((248, 249, 250, 323, 425, 426, 427), "ENOSYS") | dict.fromkeys((101, 310, 311, 438), "EPERM")
# AF_UNIX, AF_INET, AF_INET6 and AF_NETLINK; AF_PACKET, AF_BLUETOOTH, AF_ALG and AF_VSOCK.
SOCKETS = {1: "OK", 2: "OK", 10: "OK", 16: "OK"} | dict.fromkeys((17, 31, 38, 40), "EAFNOSUPPORT")


@pytest.mark.parametrize("how", ["cold", "warm"])
def test_it_cannot_make_calls_that_lead_out_of_its_sandbox(start: Start, how: str):
    text = f"""
        import ctypes, errno, socket
        libc, answers = ctypes.CDLL(None, use_errno=True), {{}}
        for number in {list(REFUSED)}:
            answer = libc.syscall(number, 0, 0, 0, 0, 0, 0)
            answers[number] = errno.errorcode[ctypes.get_errno()] if answer < 0 else "OK"
        families = {{}}
        for family in {list(SOCKETS)}:
            try:
                socket.socket(family, socket.SOCK_DGRAM).close()
                families[family] = "OK"
            except OSError as error:
                families[family] = errno.errorcode[error.errno]
        print(answers, families)
    """
    assert ended(start(how, text)) == (0, f"{REFUSED} {SOCKETS}\n")


@pytest.mark.parametrize("how", ["cold", "warm"])
def test_it_possesses_no_key_of_the_grader(install: Path, how: str):
    """The session keyring is in no namespace: a login's keys were open to each sandbox, and one could leave keys."""
    libc = ctypes.CDLL(None)
    libc.syscall(250, 1, None)  # keyctl, KEYCTL_JOIN_SESSION_KEYRING: not the keyring of whoever runs the tests
    key = libc.syscall(248, b"user", b"kit:secret", b"abc", 3, -3)  # add_key, to the session keyring
    if key < 0:
        pytest.skip("this kernel has no keyrings, or they are forbidden here")
    libc.syscall(250, 5, key, 0x3F000000)  # KEYCTL_SETPERM: who does not possess it cannot see it either
    assert "kit:secret" in Path("/proc/keys").read_text()
    command = write(install, "print('kit:secret' in open('/proc/keys').read())")
    with WarmPython(ENVIRONMENT) as own:
        process = sandbox.Process(command, box(install), LIMITS, own if how == "warm" else None)
        assert ended(process) == (0, "False\n")


def test_it_is_in_the_namespaces_of_its_sandbox_alone(start: Start):
    process = start("warm", "import time; print('up', flush=True); time.sleep(600)")
    await_output(process, "up")
    assert process._program is not None
    own, first, program = (namespaces(pid) for pid in (os.getpid(), process._init_pid, process._program.pid))
    assert program == first
    assert {name for name in own if own[name] == program[name]} <= {"net", "time", "time_for_children", "user"}


def namespaces(pid: int) -> dict[str, int]:
    return {path.name: path.stat().st_ino for path in Path(f"/proc/{pid}/ns").iterdir()}


@pytest.mark.slow  # two starts for each of many ends
@pytest.mark.parametrize(
    "text",
    [
        "raise ValueError('no')",
        "def f():\n    g()\ndef g():\n    raise ValueError('no')\nf()",
        "import json\njson.loads('{')",
        "try:\n    1 / 0\nexcept ZeroDivisionError as error:\n    raise ValueError('no') from error",
        "this is no Python",
        "import no_such_module",
        "raise KeyboardInterrupt",
        "raise SystemExit",
        "import sys; sys.exit(3)",
        "import sys; sys.exit(255)",
        "import sys; sys.exit('goodbye')",
        "import os; os._exit(4)",
        "import os, signal; os.kill(os.getpid(), signal.SIGKILL)",
        "import atexit; atexit.register(print, 'at exit'); print('before')",
        "import threading; threading.Thread(target=print, args=('thread',)).start()",
        "import threading\ndef f():\n    raise ValueError('in a thread')\nthreading.Thread(target=f).start()",
        "print(__name__, __file__); import __main__; print(sorted(vars(__main__)))",
        "import inspect; print([frame.function for frame in inspect.stack()][:1])",
        "from rclpy.node import Node; import rclpy; rclpy.init(); print(Node('n').get_name()); rclpy.shutdown()",
        "import multiprocessing as m\nif __name__ == '__main__':\n  with m.Pool(1) as p:\n    print(p.map(abs, [-1]))",
        "import subprocess as s; print(s.run(['id', '-un'], capture_output=True).returncode)",
        "print(open('/dev/stdin').read() == '', input())",
        "print(open('/etc/shadow').read())",
        "import ctypes; print(ctypes.CDLL(None).unshare(0x10000000))",
    ],
)
def test_it_ends_in_the_same_way_and_says_the_same(start: Start, text: str):
    (cold_code, cold), (warm_code, forked) = ended(start("cold", text)), ended(start("warm", text))
    assert (warm_code, forked) == (cold_code, cold)


def test_no_thread_of_lttngs_waits_for_the_programs_children(start: Start):
    """Each made its shared memory in a child and waited for any: the program's own was gone, with exit status 0."""
    text = """
        import time
        end = time.monotonic() + 20.0
        while open("/proc/self/maps").read().count("/dev/shm/lttng-ust-wait-") < 2 and time.monotonic() < end:
            time.sleep(0.01)
        mapped = open("/proc/self/maps").read().count("/dev/shm/lttng-ust-wait-")
        faults_of_children = int(open("/proc/self/stat").read().rpartition(")")[2].split()[8])
        print(mapped, faults_of_children)
    """
    assert ended(start("warm", text)) == (0, "2 0\n")


@pytest.mark.parametrize("how", ["cold", "warm"])
def test_what_it_leaves_running_is_gone_once_it_has_ended(start: Start, how: str):
    """bubblewrap ends before the kernel has killed the rest, which went on for some milliseconds: it could write."""
    text = """
        import os, time
        try:
            for _ in range(40):
                if os.fork() == 0:
                    os.setsid()
                    used = bytearray(2_000_000)
                    time.sleep(600)
            print("up", flush=True)
            time.sleep(600)
        except KeyboardInterrupt:
            print("parent ends")
    """
    process = start(how, text)
    await_output(process, "up")
    running = [pid for pid in procfs.descendants(os.getpid()) if "lib/pkg/node" in command_line(pid)]
    assert len(running) >= 41
    process.interrupt()
    assert process.wait(30.0) == 0
    assert [pid for pid in running if procfs.runs(pid)] == []


def test_its_signals_to_its_own_group_reach_nobody_else(start: Start, warm: WarmPython):
    text = "import os, signal; signal.signal(signal.SIGTERM, print); os.kill(0, signal.SIGTERM); print('on')"
    assert ended(start("warm", text))[1].endswith("on\n")
    assert ended(start("warm", "print('still there')")) == (0, "still there\n")


def test_it_is_interrupted_as_by_ctrl_c(start: Start):
    text = """
        import time
        try:
            print("up", flush=True)
            time.sleep(600)
        except KeyboardInterrupt:
            print("interrupted")
    """
    process = start("warm", text)
    await_output(process, "up\n")
    process.interrupt()
    assert ended(process) == (0, "up\ninterrupted\n")


def test_it_says_where_it_hangs(start: Start):
    process = start("warm", "import time\ndef stuck():\n    print('up', flush=True)\n    time.sleep(600)\nstuck()")
    await_output(process, "up")
    process.abort()
    code, output = ended(process)
    assert code == -signal.SIGABRT
    assert any(f'lib/pkg/node", line {line} in stuck' in output for line in (4, 5))  # it still prints, or sleeps


def test_its_time_is_measured(start: Start):
    process = start("warm", "import time\nwhile time.process_time() < 0.2:\n    pass\ntime.sleep(600)")
    deadline = time.monotonic() + 60.0
    while process.cpu_seconds() < 0.1:
        assert time.monotonic() < deadline
    assert sum(ran for ran, _ in process.thread_times().values()) > 0.05


@pytest.mark.parametrize("how", ["cold", "warm"])
def test_its_end_is_seen_before_bubblewrap_has_told_its_exit_status(start: Start, how: str):
    """On a machine of load 20 that took two seconds, and a node was charged with them."""
    process = start(how, "import time; print('up', flush=True); time.sleep(600)")
    await_output(process, "up")
    assert not process.has_ended()
    os.kill(process._popen.pid, signal.SIGSTOP)
    process.interrupt()
    deadline = time.monotonic() + 60.0
    while not process.has_ended():
        assert time.monotonic() < deadline
        time.sleep(0.005)
    assert process.exit_code() is None
    os.kill(process._popen.pid, signal.SIGCONT)
    assert process.wait(60.0) is not None


@pytest.mark.skipif(cgroup.find_hierarchy() is None, reason="no cgroup can be made here")
def test_its_processes_are_counted_with_those_of_its_sandbox(install: Path, warm: WarmPython):
    bomb = write(install, "import os\nwhile True:\n    os.fork()")
    limits = sandbox.Limits(wall_seconds=60.0, processes=64)
    with sandbox.Process(bomb, box(install), limits, warm) as process:
        assert process._program is not None
        deadline = time.monotonic() + 30.0
        while process.stopped() != "processes" and time.monotonic() < deadline:
            time.sleep(0.01)
    assert process.stopped() == "processes"


def test_no_two_programs_draw_the_same_numbers(start: Start):
    text = (
        "import random, numpy, uuid, os; print(random.random(), numpy.random.rand(), uuid.uuid4(), os.urandom(8).hex())"
    )
    outputs = [ended(start("warm", text))[1].split() for _ in range(2)]
    assert all(one != other for one, other in zip(*outputs, strict=True))


def test_it_knows_nothing_of_what_started_it(start: Start):
    """What is left of it is a frame with the names of its functions."""
    text = """
        import sys
        frame = sys._getframe(1)
        print(frame.f_code.co_filename.startswith("/dev/fd/"))
        print([name for name, value in frame.f_globals.items() if isinstance(value, dict) and "init" in value])
    """
    assert ended(start("warm", text)) == (0, "True\n[]\n")


def no_change(_install: Path) -> None:
    pass


@pytest.mark.slow  # a start for each of many trees
@pytest.mark.parametrize(
    ("first", "change", "suits"),
    [
        ("#!/usr/bin/env python3", no_change, True),
        (f"#!{ros_env.PREFIX}/bin/python3", no_change, True),
        ("#!/usr/bin/python3", no_change, False),
        ("#!/usr/bin/env python3 -O", no_change, False),
        ("#!/usr/bin/env python3\r", no_change, False),
        ("#!/bin/sh", no_change, False),
        ("\x7fELF", no_change, False),
        ("#!/usr/bin/env python3", lambda install: (install / "lib" / "pkg" / "json.py").touch(), False),
        ("#!/usr/bin/env python3", lambda install: module(install, "numpy"), False),
        ("#!/usr/bin/env python3", lambda install: module(install, "geometry_msgs"), False),
        ("#!/usr/bin/env python3", lambda install: module(install, "sitecustomize"), False),
        ("#!/usr/bin/env python3", lambda install: module(install, "own"), True),
        ("#!/usr/bin/env python3", lambda install: (install / "lib" / "librcl.so").touch(), False),
        ("#!/usr/bin/env python3", lambda install: libraries(install, "p"), True),
        ("#!/usr/bin/env python3", lambda install: libraries(install, "p", "q"), False),
        ("#!/usr/bin/env python3", lambda install: libraries(install, "std_msgs"), False),
        ("#!/usr/bin/env python3", lambda install: (install / "lib" / "libown.so").touch(), False),
    ],
)
def test_only_what_would_find_the_same_modules_is_forked(
    install: Path, warm: WarmPython, first: str, change: Callable[[Path], None], suits: bool
):
    command = write(install, "print('ran')", first=first)
    change(install)
    assert warm.suits(command, box(install)) is suits


def module(install: Path, name: str) -> None:
    folder = install / ros_env.SITE_IN_PREFIX
    folder.mkdir(parents=True)
    (folder / f"{name}.py").touch()


def libraries(install: Path, *packages: str) -> None:
    for package in packages:
        (install / "lib" / f"lib{package}__rosidl_generator_c.so").touch()
        (install / "lib" / f"lib{package}__rosidl_typesupport_fastrtps_cpp.so").touch()


@pytest.mark.slow  # three starts
@pytest.mark.parametrize("name", ["libown.so", "libp__rosidl_more_c.so", "libp__rosidl_typesupport_cpp.so"])
def test_no_library_runs_that_the_program_does_not_load(install: Path, warm: WarmPython, name: str):
    """A fork loaded all that were installed, and what is in a library nobody reads."""
    text = '#include <stdio.h>\n__attribute__((constructor)) void run(void) { puts("ran"); fflush(stdout); }'
    command = ["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", str(install / "lib" / name)]
    subprocess.run(command, input=text, text=True, check=True)
    with sandbox.Process(write(install, "print('only this')"), box(install), LIMITS, warm) as process:
        assert ended(process) == (0, "only this\n")


def test_a_file_that_is_a_link_or_cannot_be_executed_is_started_as_before(install: Path, warm: WarmPython):
    command = write(install, "")
    path = install / "lib" / "pkg" / "node"
    path.chmod(0o644)
    assert not warm.suits(command, box(install))
    path.rename(path.with_name("other"))
    path.symlink_to("other")
    assert not warm.suits(command, box(install))


def test_other_environments_networks_and_writable_folders_are_started_as_before(
    install: Path, warm: WarmPython, tmp_path: Path
):
    command, own = write(install, ""), box(install)
    environment = {**own.environment, "OPENBLAS_NUM_THREADS": "2"}
    assert not warm.suits(command, sandbox.Sandbox(own.read_only, environment=environment, network=True))
    assert not warm.suits(command, sandbox.Sandbox(own.read_only, environment=own.environment))
    written = sandbox.Sandbox(own.read_only, {tmp_path: "/ws/out"}, environment=own.environment, network=True)
    assert not warm.suits(command, written)
    assert not warm.suits(["python3", "-c", "pass"], own)


@pytest.mark.slow  # one more process to fork from
def test_where_the_kernel_does_not_allow_it_programs_are_started_as_before(
    install: Path, monkeypatch: pytest.MonkeyPatch
):
    command = write(install, "print('ran')")
    with WarmPython(ENVIRONMENT) as own:
        monkeypatch.setattr("grader.sandbox.warm_start.PROGRAM_BYTES", b"no filter")
        with pytest.raises(CannotFork, match="Invalid argument"):
            start_forked(own, install, command)
        assert not own.suits(command, box(install))
        with WarmPython(ENVIRONMENT) as other:
            process = sandbox.Process(command, box(install), LIMITS, other)
            assert ended(process) == (0, "ran\n")
    assert not other.suits(command, box(install))


def start_forked(warm: WarmPython, install: Path, command: list[str]) -> None:
    with sandbox.Process(["sleep", "60"], box(install), LIMITS) as process:
        user, group = process._user, process._group
        warm.start(command, box(install), LIMITS, init=process._init_pid, output=2, hold=2, user=user, group=group)


def test_nothing_is_printed_when_nobody_asks_for_its_end_any_more(install: Path, capfd: pytest.CaptureFixture[str]):
    """Else Ctrl-C in a grading would show a traceback for each node that runs."""
    command = write(install, "import time; print('up', flush=True); time.sleep(600)")
    with WarmPython(ENVIRONMENT) as own, sandbox.Process(command, box(install), LIMITS, own) as process:
        await_output(process, "up")
        assert process._program is not None
        process._program._lines.close()
        os.kill(process._program.pid, signal.SIGKILL)
        assert process._popen.wait(60.0) is not None  # the sandbox is there for as long as what waits for the program
        process._program = None
    assert capfd.readouterr().err == ""


@pytest.mark.slow  # one more process to fork from
def test_its_end_is_known_when_the_process_that_started_it_has_ended(install: Path):
    command = write(install, "import time; print('up', flush=True); time.sleep(1); print('done')")
    with WarmPython(ENVIRONMENT) as own:
        process = sandbox.Process(command, box(install), LIMITS, own)
        await_output(process, "up")
    assert ended(process) == (0, "up\ndone\n")


def command_line(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""
