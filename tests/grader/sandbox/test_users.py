"""The sandbox without namespaces: what a command that runs as another user sees, may do, and leaves behind."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from helpers import until

from grader import sandbox
from grader.errors import GraderError
from grader.host import namespaces, ros_env, submission_user
from grader.sandbox import Limits, Process, Sandbox, user_command, users

pytestmark = [
    pytest.mark.sandbox,
    pytest.mark.skipif(os.geteuid() != 0, reason="only root has other users; run the tests as root"),
    pytest.mark.skipif(bool(submission_user.lacks()), reason=f"cannot work here: {submission_user.lacks()}"),
]
ENVIRONMENT = ros_env.environment(home=sandbox.HOME)
_LANDLOCK = ctypes.CDLL(None).syscall(444, None, 0, 1)
TCP = "PermissionError" if _LANDLOCK >= 4 else "done"


@pytest.fixture(autouse=True)
def no_namespaces(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ROS2_COURSE_KIT_NAMESPACES", "this test forbids them")
    assert namespaces.confinement() is namespaces.Confinement.USERS


def python(code: str, box: Sandbox | None = None, **limits: float) -> sandbox.RunResult:
    box = box or Sandbox(environment=ENVIRONMENT)
    return sandbox.run(["python3", "-c", code], box, Limits(wall_seconds=limits.get("wall_seconds", 60.0)))


def tried(*statements: str) -> str:
    """Return a program that prints, for each statement, what kept it from working, "done" if nothing did."""
    return "import os, socket, signal, subprocess\n" + "".join(
        f"try:\n    {each}\n    print('done')\nexcept OSError as error:\n    print(type(error).__name__)\n"
        for each in statements
    )


def test_a_command_finds_its_folders_at_the_paths_of_every_grading(tmp_path: Path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "text").write_text("given")
    (tmp_path / "other").write_text("over it")
    (tmp_path / "out").mkdir()
    box = Sandbox(
        read_only={tmp_path / "in": "/ws/install", tmp_path / "other": "/ws/install/other"},
        writable={tmp_path / "out": "/ws/out"}, environment=ENVIRONMENT, cwd="/ws/out",
    )  # fmt: skip
    code = "import os; open('made', 'w').write(open('/ws/install/text').read()); print(os.getcwd())"
    code += "; print(open('/ws/install/other').read(), os.path.realpath('/ws/install'), os.environ['HOME'])"
    assert python(code, box).output == "/ws/out\nover it /ws/install /home/student\n"
    assert (tmp_path / "out" / "made").read_text() == "given"
    assert not (tmp_path / "out").is_symlink()
    assert (tmp_path / "out" / "made").stat().st_uid == 0


def test_what_the_grader_writes_meanwhile_reaches_the_command(tmp_path: Path):
    """Requests to run a test are handed to a worker that has been started before."""
    for name in ("requests", "out"):
        (tmp_path / name).mkdir()
    box = Sandbox(
        read_only={tmp_path / "requests": "/ws/requests"}, writable={tmp_path / "out": "/ws/out"},
        environment=ENVIRONMENT, fed=(tmp_path / "requests",),
    )  # fmt: skip
    loop = (
        "until cp /ws/requests/one /ws/out/answer 2>/dev/null; do sleep 0.01; done; touch /ws/requests/two || exec cat"
    )
    with Process(["sh", "-c", loop], box, Limits()) as process:
        (tmp_path / "requests" / "one").write_text("asked")
        assert process.wait(60) == 0
    assert (tmp_path / "out" / "answer").read_text() == "asked"
    assert not (tmp_path / "requests" / "two").exists()


@pytest.mark.parametrize("unsafe", [False, True])
def test_nothing_of_the_graders_can_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unsafe: bool):
    """Also where the kernel has no Landlock, which --unsafe-no-sandbox leaves out."""
    if unsafe:
        monkeypatch.setenv(namespaces.UNSAFE_VARIABLE, "1")
    secret = tmp_path / "secret"
    secret.write_text("the expected values")
    tmp_path.chmod(0o700)
    other = users.lay_out(Sandbox(), submission_user.new_id())
    statements = [f"os.listdir({str(tmp_path)!r})", f"open({str(secret)!r})", "open('/etc/shadow')"]
    statements += [f"os.listdir({str(other.folder)!r})", f"open({str(other.folder / 'tmp' / 'x')!r}, 'w')"]
    said = python(tried(*statements)).output.split()
    other.close()
    assert "done" not in said
    assert len(said) == len(statements)


def test_a_command_reaches_no_other_process_and_no_port():
    statements = [
        f"os.kill({os.getpid()}, 0)", f"open('/proc/{os.getpid()}/environ')", f"os.listdir('/proc/{os.getpid()}/fd')",
        "socket.socket(socket.AF_PACKET, socket.SOCK_RAW)", "os.setuid(0)", "os.chroot('/tmp')",
        "open('/proc/sys/kernel/core_pattern', 'w')", "open('/usr/lib/evil', 'w')", "open('/var/tmp/evil', 'w')",
    ]  # fmt: skip
    said = python(tried(*statements)).output.split()
    assert "done" not in said
    assert len(said) == len(statements)


@pytest.mark.skipif(not Path("/dev/shm").is_mount(), reason="needs a second disk: /dev/shm")
def test_a_folder_on_another_disk_comes_back_with_all_that_is_in_it():
    """In a container the cache is often a volume; a copy belonged to root, and a pipe in it stopped the copying."""
    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
        out = Path(folder, "out")
        out.mkdir()
        box = Sandbox(writable={out: "/ws/out"}, environment=ENVIRONMENT)
        assert python("import os; os.mkfifo('/ws/out/pipe'); open('/ws/out/file', 'w')", box).exit_code == 0
        assert sorted(path.name for path in out.iterdir()) == ["file", "pipe"]


def test_each_sandbox_has_a_user_and_temporary_files_of_its_own():
    code = "import os; print(os.getuid(), os.path.exists('/tmp/left')); open('/tmp/left', 'w')"
    (first, left), (second, left_again) = (python(code).output.split() for _ in range(2))
    assert first != second
    assert (left, left_again) == ("False", "False")


def test_no_process_of_a_sandbox_outlives_it():
    """A daemon that has left its session, and whose parent has ended, has no tie to the sandbox but its user."""
    code = "import os, subprocess; subprocess.Popen('setsid sleep 1000 & setsid sleep 1000 &', shell=True)"
    user = int(python(f"{code}; print(os.getuid())").output)
    assert _processes_of(user) == []


def test_a_command_that_has_used_up_its_processes_is_killed_all_the_same():
    """What kills them had to be forked first, for which no process was left: all of them went on."""
    code = (
        "import os, time\ntry:\n    while os.fork():\n        pass\n    os.setsid()\n"
        "except OSError:\n    print(os.getuid(), flush=True)\ntime.sleep(1000)"
    )
    with Process(["python3", "-c", code], Sandbox(environment=ENVIRONMENT), Limits(processes=64)) as process:
        user = int(_printed(process))
    assert _processes_of(user) == []


def test_no_process_outlives_the_one_that_started_them():
    """It is killed where it does not end in time, and out of memory; the command went on."""
    code = "import os, time; print(os.getuid(), flush=True); time.sleep(1000)"
    with Process(["python3", "-c", code], Sandbox(environment=ENVIRONMENT), Limits()) as process:
        user = int(_printed(process))
        process._popen.kill()
        until(lambda: not _processes_of(user))


def _printed(process: Process) -> str:
    until(lambda: process.output.endswith("\n"))
    return process.output


def test_a_killed_grader_leaves_no_process(tmp_path: Path):
    code = (
        "import sys, time; from grader import sandbox; from grader.sandbox import Process, Sandbox, Limits\n"
        "from grader.host import ros_env\n"
        "box = Sandbox(environment=ros_env.environment(home=sandbox.HOME))\n"
        "process = Process(['sh', '-c', 'id -u; exec sleep 1000'], box, Limits())\n"
        "while not process.output.strip(): time.sleep(0.01)\n"
        "print(process.output, flush=True); time.sleep(1000)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as grader:
        assert grader.stdout is not None
        user = int(grader.stdout.readline())
        assert _processes_of(user)
        grader.kill()
    until(lambda: not _processes_of(user))


def _processes_of(user: int) -> list[str]:
    listed = subprocess.run(["ps", "-o", "pid=,stat=", "-U", str(user)], capture_output=True, text=True, check=False)
    return [line for line in listed.stdout.splitlines() if "Z" not in line]


def test_a_sandbox_leaves_nothing_behind_but_what_the_grader_asked_for():
    """Each left two entries of proot's in /tmp, and a submission could leave shared memory to the next one."""
    code = "import ctypes, os; print(os.getuid(), ctypes.CDLL(None).shmget(1, 4096, 0o1777)); open('/dev/shm/x', 'w')"
    user, segment = map(int, python(code).output.split())
    assert segment == -1
    places = [path for place in ("/tmp", "/dev/shm", "/var/tmp/ros2-course-kit") for path in Path(place).iterdir()]
    assert [path for path in places if path.lstat().st_uid == user] == []


def test_what_a_command_reaches_all_the_same():
    """docs/containers.md lists it: a port for datagrams, a socket open to all, and the names of processes; no TCP."""
    datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    connections = socket.create_server(("127.0.0.1", 0))
    datagrams.bind(("127.0.0.1", 0))
    local = socket.socket(socket.AF_UNIX)
    with datagrams, connections, local, tempfile.TemporaryDirectory(dir="/var/tmp") as folder:
        Path(folder).chmod(0o755)
        local.bind(f"{folder}/socket")
        local.listen()
        Path(folder, "socket").chmod(0o777)
        statements = [
            f"socket.create_connection(('127.0.0.1', {connections.getsockname()[1]}))",
            f"socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'x', {datagrams.getsockname()!r})",
            f"open('/proc/{os.getpid()}/cmdline').read()",
            f"socket.socket(socket.AF_UNIX).connect('{folder}/socket')",
        ]
        assert python(tried(*statements)).output.split() == [TCP, "done", "done", "done"]
        datagrams.settimeout(60)
        assert datagrams.recv(10) == b"x"


def test_no_way_to_connect_by_tcp_is_left_that_landlock_does_not_see():
    """Multipath TCP, and data that is sent with the first packet (fast open), reached every port of the network."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = server.getsockname()
        mptcp, fast_open, stream = 262, 0x20000000, "socket.socket(socket.AF_INET, socket.SOCK_STREAM"
        statements = [
            f"{stream}, {mptcp}).connect({address!r})",
            f"{stream}).sendto(b'x', {fast_open}, {address!r})",
            f"{stream}).sendmsg([b'x'], [], {fast_open}, {address!r})",
            f"{stream}, socket.IPPROTO_TCP).connect({address!r})",
        ]
        assert python(tried(*statements)).output.split() == ["OSError", "OSError", "OSError", TCP]


def test_how_a_command_ended_is_known():
    assert python("raise SystemExit(7)").exit_code == 7
    assert python("import os; os.kill(os.getpid(), 9)").exit_code == -signal.SIGKILL
    assert python("import time; time.sleep(1000)", wall_seconds=1.0).timed_out


def test_an_interrupt_reaches_the_command():
    with Process(["python3", "-c", "print('up', flush=True); import time; time.sleep(1000)"],
                 Sandbox(environment=ENVIRONMENT), Limits()) as process:  # fmt: skip
        until(lambda: "up" in process.output)
        process.interrupt()
        assert process.wait(60) == -signal.SIGINT
    assert "KeyboardInterrupt" in process.output


def test_the_filter_of_kernel_calls_is_in_force():
    code = "import ctypes; c = ctypes.CDLL(None, use_errno=True); print(c.syscall(425, 1, 0), ctypes.get_errno())"
    assert python(code).output == "-1 38\n"  # io_uring_setup


def test_programs_see_their_folders_that_use_calls_which_proot_does_not_know(tmp_path: Path):
    """`ls` found nothing below /ws, where Python did."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "given").touch()
    box = Sandbox(read_only={tmp_path / "in": "/ws/install"}, environment=ENVIRONMENT)
    assert sandbox.run(["ls", "/ws/install"], box).output == "given\n"


def test_a_build_of_many_small_files_is_not_crashed_by_proot(tmp_path: Path):
    """proot 5.1 crashed ninja or its compilers, and the build was charged to the submission."""
    rule = "rule copy\n  command = sh -c 'sort $in | gcc -x c -c - -o $out'\n"
    (tmp_path / "int.c").write_text("int a;\n")
    (tmp_path / "build.ninja").write_text(rule + "".join(f"build {n}.o: copy int.c\n" for n in range(40)))
    box = Sandbox(writable={tmp_path: "/ws/build"}, environment=ENVIRONMENT, cwd="/ws/build")
    ninja = [str(ros_env.PREFIX / "bin" / "ninja"), "-j4"]
    ended = [sandbox.run([*ninja, "-t", "clean"], box), sandbox.run(ninja, box)]
    assert [each.exit_code for each in ended] == [0, 0], ended


def test_a_fork_bomb_is_ended_at_once_where_no_cgroup_can_be_made(monkeypatch: pytest.MonkeyPatch):
    """Its processes kept every core busy until the time of each trial was over."""
    monkeypatch.setattr("grader.host.cgroup.find_hierarchy", lambda: None)
    bomb = "import os, time\nwhile True:\n    try:\n        os.fork()\n    except OSError:\n        time.sleep(0.01)"
    result = sandbox.run(["python3", "-c", bomb], Sandbox(environment=ENVIRONMENT), Limits(processes=64))
    assert (result.stopped, result.timed_out) == ("processes", False)


def test_what_fills_the_folders_for_temporary_files_is_stopped():
    """They are disks in memory under bubblewrap, with a size; here a node could fill the container's disk."""
    code = (
        "for folder in ('/tmp', '/dev/shm'):\n for n in range(4):\n"
        "  open(f'{folder}/{n}', 'wb').write(bytes(1 << 20))\nimport time; time.sleep(100)"
    )
    result = sandbox.run(
        ["python3", "-c", code], Sandbox(environment=ENVIRONMENT), Limits(wall_seconds=60, disk_bytes=6 << 20)
    )
    assert result.stopped == "disk"


def test_another_user_grades_for_no_points_without_namespaces(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with pytest.raises(GraderError, match="no points are given"):
        sandbox.require()
    assert namespaces.notice() == namespaces.NONE_NOTICE


def test_without_proot_the_fix_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(submission_user, "lacks", lambda: "proot is not installed")
    with pytest.raises(GraderError, match=r"and proot is not installed. Run `grader doctor`"):
        sandbox.require()


def test_the_command_is_asked_for_in_json_that_names_no_path_of_the_graders():
    """Anyone may read a process's arguments in /proc."""
    view = users.lay_out(Sandbox(), submission_user.new_id())
    *_, asked = users.command_line(["true"], Sandbox(), view, user=7, info_fd=user_command.INFO)
    view.close()
    assert not [path for path in json.loads(asked)["landlock"]["read"] if "grader" in Path(path).name]


def test_a_pipe_in_a_read_only_folder_may_be_written_into(tmp_path: Path):
    os.mkfifo(tmp_path / "pipe")
    tmp_path.chmod(0o755)
    end = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    (tmp_path / "pipe").chmod(0o222)
    box = Sandbox({tmp_path: "/ws/ran"}, environment=ENVIRONMENT, pipes=(tmp_path / "pipe",))
    assert sandbox.run(["sh", "-c", "echo start > /ws/ran/pipe; ! cat /ws/ran/pipe; ! rm /ws/ran/pipe"], box).ok
    assert os.read(end, 100) == b"start\n"
    os.close(end)
