"""The sandbox: what a command in it sees, may use, and leaves behind."""

from __future__ import annotations

import ctypes
import os
import signal
import time
import uuid
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import running, until

from grader import pipeline, report, sandbox
from grader.errors import GraderError
from grader.host import namespaces, procfs, ros_env, submission_user
from grader.report import console
from grader.sandbox import MIB, Limits, Process, Sandbox, process
from grader.sandbox.cpu_clock import CpuClock

pytestmark = pytest.mark.sandbox

PYTHON = Sandbox(environment=ros_env.environment(home=sandbox.HOME))


def python(code: str, box: Sandbox = PYTHON, **limits: object) -> sandbox.RunResult:
    return sandbox.run(["python3", "-c", code], box, Limits(**{"wall_seconds": 30.0, **limits}))  # type: ignore[arg-type]


def test_the_result_has_the_exit_code_and_the_output():
    assert python("print('hello')") == sandbox.RunResult(0, "hello\n", False, pytest.approx(0, abs=30))  # type: ignore[arg-type]  # equals a number
    assert python("raise SystemExit(7)").exit_code == 7
    assert python("import os; os.kill(os.getpid(), 11)").exit_code == -11


def test_the_submission_sees_neither_our_sources_nor_the_users_files(tmp_path: Path):
    secret = tmp_path / "results.json"
    secret.write_text("{}")
    kit = Path(sandbox.__file__ or "")
    paths = [str(secret), str(kit), "/etc/shadow", str(Path.home() / ".bashrc")]
    code = f"import os; print([os.path.exists(path) for path in {paths}])"
    assert python(code).output == "[False, False, False, False]\n"


def test_no_setting_of_the_kernel_can_be_written():
    """As root 763 of them could, core_pattern among them: code as root on the host at the next crash."""
    code = (
        "import os\n"
        "own = {'self', 'thread-self', *(name for name in os.listdir('/proc') if name.isdigit())}\n"
        "tops = [f'/proc/{name}' for name in os.listdir('/proc') if name not in own]\n"
        "files = [os.path.join(here, name) for top in tops for here, _, names in os.walk(top) for name in names]\n"
        "files += [top for top in tops if os.path.isfile(top)]\n"
        "print(len(files) > 100, [path for path in files if os.access(path, os.W_OK)])"
    )
    assert python(code).output == "True []\n"


def test_a_command_cannot_become_root_of_a_namespace():
    """With a user namespace of its own it could mount, and reach parts of the kernel that are root's."""
    code = (
        "import ctypes, os, subprocess\n"
        "libc = ctypes.CDLL(None, use_errno=True)\n"
        "flags = 0x10000000 | 0x20000 | 17\n"  # CLONE_NEWUSER, CLONE_NEWNS, SIGCHLD
        "answers = [libc.unshare(0x10000000), libc.syscall(56, flags, 0, 0, 0, 0), libc.syscall(435, 0, 0)]\n"
        "print(answers, ctypes.get_errno(), libc.mount(b'proc', b'/tmp', b'proc', 0, None))\n"
        "print(subprocess.run(['echo', 'a child']).returncode)"
    )
    assert python(code).output == "[-1, -1, -1] 38 -1\na child\n0\n"


@pytest.mark.skipif(os.geteuid() != 0, reason="about a grader that is root; run the tests as root")
def test_root_runs_commands_as_a_user_that_owns_nothing(tmp_path: Path):
    """As root of this machine they were held back by nothing but read-only mounts."""
    tmp_path.chmod(0o755)
    secret, roots = tmp_path / "secret", tmp_path / "file"
    for path, mode in ((secret, 0o600), (roots, 0o644)):
        path.write_text("root's")
        path.chmod(mode)
    code = (
        "import os, stat\n"
        "print(os.getuid() > 1000, os.stat('/in/file').st_uid, set(os.getgroups()) <= {os.getgid()})\n"
        "print([os.access(f'/in/{name}', os.R_OK) for name in ('secret', 'file')], os.access('/in/file', os.W_OK))\n"
        "print([line.split()[1] for line in open('/proc/self/status') if line.startswith(('CapPrm', 'CapEff'))])"
    )
    box = Sandbox(read_only={tmp_path: "/in"}, environment=PYTHON.environment)
    assert python(code, box).output == "True 0 True\n[False, True] False\n['0000000000000000', '0000000000000000']\n"


@pytest.mark.skipif(os.geteuid() != 0, reason="about a grader that is root; run the tests as root")
def test_what_a_command_leaves_belongs_to_the_grader_and_runs_as_nobody_else(tmp_path: Path):
    box = Sandbox(writable={tmp_path: "/ws/out"}, environment=PYTHON.environment)
    made = "cd /ws/out && mkdir -p a/b && cp /bin/true a/b/tool && chmod 6755 a/b/tool && ln -s /etc/passwd link"
    owner = Path("/etc/passwd").stat().st_uid
    assert sandbox.run(["sh", "-c", made], box).ok
    tool = tmp_path / "a" / "b" / "tool"
    assert (tool.stat().st_uid, tool.stat().st_mode & 0o7777) == (os.geteuid(), 0o755)
    assert ((tmp_path / "link").lstat().st_uid, Path("/etc/passwd").stat().st_uid) == (os.geteuid(), owner)


@pytest.mark.skipif(os.geteuid() != 0, reason="about a grader that is root; run the tests as root")
def test_a_file_that_only_root_can_read_is_the_graders_error(tmp_path: Path):
    """The submission would be charged with what it cannot read."""
    tmp_path.chmod(0o700)
    with pytest.raises(GraderError, match="can be read by root alone"):
        sandbox.run(["true"], Sandbox(read_only={tmp_path: "/ws/in"}))


def test_each_sandbox_of_root_has_a_user_of_its_own_within_the_ids_of_a_container(monkeypatch: pytest.MonkeyPatch):
    ids = {submission_user.new_id() for _ in range(3)}
    monkeypatch.setattr(Path, "read_text", lambda *_: "         0     100000      65536\n")
    assert len({submission_user.new_id() for _ in range(3)} & set(range(20_000, 60_000))) > 1
    monkeypatch.setattr(Path, "read_text", lambda *_: "         0     100000      1\n")
    assert submission_user.new_id() == 65534
    monkeypatch.setattr(Path, "read_text", lambda *_: "         0          0 4294967295\n")
    assert len(ids | {submission_user.new_id() for _ in range(3)}) > 1


def test_where_root_cannot_give_submissions_another_user_they_run_as_before(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(submission_user, "refusal", lambda: "setpriv: setresuid failed: Invalid argument")
    assert submission_user.runs_as_root()
    assert submission_user.choose() is None
    assert "runs as root too" in submission_user.notice()
    assert python("print('graded')").output == "graded\n"


# add_key, request_key, keyctl, userfaultfd, io_uring's three; ptrace, process_vm_readv and _writev, pidfd_getfd.
REFUSED = dict.fromkeys((248, 249, 250, 323, 425, 426, 427), "ENOSYS") | dict.fromkeys((101, 310, 311, 438), "EPERM")
# AF_UNIX, AF_INET, AF_INET6 and AF_NETLINK; AF_PACKET, AF_BLUETOOTH, AF_ALG and AF_VSOCK.
SOCKETS = {1: "OK", 2: "OK", 10: "OK", 16: "OK"} | dict.fromkeys((17, 31, 38, 40), "EAFNOSUPPORT")
CALLS = f"""
import ctypes, errno, socket
libc, answers, families = ctypes.CDLL(None, use_errno=True), {{}}, {{}}
for number in {list(REFUSED)}:
    answer = libc.syscall(number, 0, 0, 0, 0, 0, 0)
    answers[number] = errno.errorcode[ctypes.get_errno()] if answer < 0 else "OK"
for family in {list(SOCKETS)}:
    try:
        socket.socket(family, socket.SOCK_DGRAM).close()
        families[family] = "OK"
    except OSError as error:
        families[family] = errno.errorcode[error.errno]
print(answers, families)
"""


def test_a_command_cannot_make_calls_that_lead_out_of_its_sandbox():
    assert python(CALLS).output == f"{REFUSED} {SOCKETS}\n"


def test_a_command_possesses_no_key_of_the_grader():
    """The session keyring is in no namespace: a login's keys were open to each sandbox, and one could leave keys."""
    libc = ctypes.CDLL(None)
    libc.syscall(250, 1, None)  # keyctl, KEYCTL_JOIN_SESSION_KEYRING: not the keyring of whoever runs the tests
    key = libc.syscall(248, b"user", b"kit:secret", b"abc", 3, -3)  # add_key, to the session keyring
    if key < 0:
        pytest.skip("this kernel has no keyrings, or they are forbidden here")
    libc.syscall(250, 5, key, 0x3F000000)  # KEYCTL_SETPERM: who does not possess it cannot see it either
    assert "kit:secret" in Path("/proc/keys").read_text()
    assert python("print('kit:secret' in open('/proc/keys').read())").output == "False\n"


def test_nothing_of_our_environment_leaks_in(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("GRADER_SECRET", "42")
    assert "GRADER_SECRET" not in python("import os; print(dict(os.environ))").output


def test_the_system_and_read_only_mounts_cannot_be_written(tmp_path: Path):
    (tmp_path / "file").write_text("before")
    tmp_path.chmod(0o755)
    box = Sandbox(read_only={tmp_path: "/ws/in"}, environment=PYTHON.environment)
    for path in ("/evil", "/ws/evil", "/usr/evil", "/ws/in/evil", "/ws/in/file", f"{ros_env.PREFIX}/evil"):
        assert "Error" in python(f"open({path!r}, 'w')", box).output
    assert (tmp_path / "file").read_text() == "before"
    # Where the submission has a user of its own, that alone would keep it from writing to the root.
    assert (
        python("print([line.split()[3][:2] for line in open('/proc/mounts') if line.split()[1] == '/'])").output
        == "['ro']\n"
    )


def test_the_only_network_is_loopback():
    code = "import socket; print(sorted(name for _, name in socket.if_nameindex()))"
    assert python(code).output == "['lo']\n"


def test_a_command_sees_only_its_own_processes():
    count = python("import os; print(len([p for p in os.listdir('/proc') if p.isdigit()]))").output
    assert int(count) <= 3


def test_a_command_that_hangs_is_stopped_with_its_whole_tree(tmp_path: Path):
    box = Sandbox(writable={tmp_path: "/ws/out"}, environment=PYTHON.environment)
    mark = uuid.uuid4().hex
    daemon = f"while true; do date > /ws/out/alive; sleep 0.05; done # {mark}"
    code = (
        f"import subprocess, time; subprocess.Popen(['sh', '-c', {daemon!r}], start_new_session=True)\ntime.sleep(1000)"
    )
    result = python(code, box, wall_seconds=2.0)
    assert result.timed_out
    assert result.exit_code is None
    assert (tmp_path / "alive").exists()
    assert running(mark) == []


def test_time_spent_waiting_for_a_core_does_not_count(monkeypatch: pytest.MonkeyPatch):
    """A thread that always waits for a core, as on a machine with a hundred other processes."""
    monkeypatch.setattr(process, "_MAX_STRETCH", 1000)
    monkeypatch.setattr(Process, "thread_times", lambda self: {1: (0.0, 2 * self.wall_seconds)})
    assert python("import time; time.sleep(1.0)", wall_seconds=0.5).exit_code == 0


def test_a_command_with_more_busy_threads_than_cores_is_stopped_too(monkeypatch: pytest.MonkeyPatch):
    cores = os.cpu_count() or 1
    monkeypatch.setattr(Process, "thread_times", lambda self: {1: (cores * self.wall_seconds, 9 * self.wall_seconds)})
    monkeypatch.setattr(process, "_MAX_STRETCH", 1000)
    assert python("import time; time.sleep(60)", wall_seconds=0.5).timed_out


def test_no_command_takes_more_than_four_times_its_limit(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(Process, "thread_times", lambda self: {1: (0.0, 9 * self.wall_seconds)})
    assert python("import time; time.sleep(60)", wall_seconds=0.2).timed_out


class Compilers:
    """A build that keeps two cores busy with four compilers at a time, each of which lives for two seconds."""

    def __init__(self) -> None:
        self.now = 0.0

    def thread_times(self) -> dict[int, tuple[float, float]]:
        """Return half of the life of each as run, the other half as waited."""
        lives = {number: self.now - 0.5 * number for number in range(int(2 * self.now) + 1)}
        return {number: (0.5 * life, 0.5 * life) for number, life in lives.items() if life < 2.0}

    def cpu_seconds(self) -> float:
        """Return what both cores have done."""
        return 2.0 * self.now


def test_a_build_that_keeps_the_cores_busy_itself_waits_for_nobody(monkeypatch: pytest.MonkeyPatch):
    """A build of 31 interfaces ran 398 s at a limit of 300: compilers that ended between two readings were not seen."""
    build = Compilers()
    monkeypatch.setattr("time.monotonic", lambda: build.now)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    clock = CpuClock(build)
    for second in range(1, 31):
        build.now = float(second)
        clock.read()
    assert clock.read() == pytest.approx(30.0)


def test_the_cpu_time_of_a_sandbox_includes_processes_that_have_ended():
    code = "import subprocess, sys, time\n"
    code += "subprocess.run([sys.executable, '-c', 'import time\\nwhile time.process_time() < 0.5: pass'])\n"
    code += "print('done', flush=True); time.sleep(1000)"
    with Process(["python3", "-c", code], PYTHON, Limits()) as ran:
        until(lambda: "done" in ran.output)
        assert ran.cpu_seconds() >= 0.5
        assert sum(seconds for seconds, _ in ran.thread_times().values()) < 0.5


def test_thread_times_cover_the_whole_process_tree():
    spins = "import os, time\nos.fork()\nos.fork()\nend = time.monotonic() + 60\nwhile time.monotonic() < end: pass"
    with Process(["python3", "-c", spins], PYTHON, Limits()) as busy:
        until(lambda: sum(ran > 0 for ran, _ in busy.thread_times().values()) >= 4)


def test_what_a_command_leaves_running_is_gone_once_it_has_ended():
    """bubblewrap ends before the kernel has killed the rest, which went on for some milliseconds: it could write."""
    mark = uuid.uuid4().hex
    code = (
        "import os, time\n"
        "for _ in range(40):\n"
        "    if os.fork() == 0:\n"
        "        os.setsid()\n"
        "        used = bytearray(2_000_000)\n"
        "        time.sleep(600)\n"
        f"print('up', flush=True)  # {mark}\n"
        "try:\n    time.sleep(600)\n"
        "except KeyboardInterrupt:\n    pass"
    )
    with Process(["python3", "-c", code], PYTHON, Limits()) as started:
        until(lambda: "up\n" in started.output)
        assert len(left := running(mark)) >= 41
        started.interrupt()
        assert started.wait(30.0) == 0
        assert [pid for pid in left if procfs.runs(int(pid))] == []


def test_an_end_is_seen_before_bubblewrap_has_told_the_exit_status():
    """On a machine of load 20 that took two seconds, and a node was charged with them."""
    with Process(["sh", "-c", "echo up; exec sleep 600"], PYTHON, Limits()) as started:
        until(lambda: "up\n" in started.output)
        assert not started.has_ended()
        os.kill(started._popen.pid, signal.SIGSTOP)
        started.interrupt()
        until(started.has_ended)
        assert started.exit_code() is None
        os.kill(started._popen.pid, signal.SIGCONT)
        assert started.wait(60.0) == -signal.SIGINT


def test_the_output_is_whole_once_the_exit_status_is_known(monkeypatch: pytest.MonkeyPatch):
    """A node that ended at its start lost its traceback if the reading thread had not had its turn yet."""
    read = process._Output._read
    monkeypatch.setattr(process._Output, "_read", lambda output: time.sleep(0.5) or read(output))
    with Process(["echo", "the last words"], PYTHON, Limits()) as said:
        until(lambda: said.exit_code() is not None)
        assert said.output == "the last words\n"


def test_endless_output_is_cut_in_the_middle():
    result = python("import sys; sys.stdout.write('a' + 'x' * 3_000_000 + 'z')", output_bytes=10_000)
    assert result.output.startswith("axx")
    assert result.output.endswith("xxz")
    assert "bytes left out" in result.output
    assert len(result.output) < 11_000


def test_output_that_is_not_text_is_shown_too():
    assert python("import sys; sys.stdout.buffer.write(b'\\xff\\xfe ok')").output.endswith(" ok")


def test_memory_files_and_core_dumps_are_limited():
    assert "MemoryError" in python("x = bytearray(2 * 1024**3)", memory_bytes=1024 * MIB).output
    assert "File too large" in python(
        "open('/tmp/big', 'wb').write(b'x' * 5_000_000)", file_bytes=1 * MIB
    ).output.replace("OSError: [Errno 27] ", "")
    assert python("import resource; print(resource.getrlimit(resource.RLIMIT_CORE))").output == "(0, 0)\n"


def test_the_clock_excludes_the_time_that_a_command_waited_for_a_core():
    """By it "ends within 2 s of Ctrl-C" is judged."""
    spin = "import threading\nfor _ in range(8): threading.Thread(target=lambda: [None for _ in iter(int, 1)]).start()"
    with Process(["python3", "-c", spin], PYTHON, Limits()) as busy:
        clock, since = CpuClock(busy), busy.wall_seconds
        until(lambda: any(waited >= 0.01 for _, waited in busy.thread_times().values()), 30.0)
        assert 0.0 < clock.read() <= busy.wall_seconds - since
    assert busy.thread_times() == {}


def test_a_sandbox_that_cannot_be_set_up_is_an_error_of_the_grader(tmp_path: Path):
    with pytest.raises(GraderError, match="grader doctor"):
        sandbox.run(["true"], Sandbox(read_only={tmp_path / "nothing": "/ws/in"}))


def test_a_host_without_bubblewrap_gets_advice(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("ROS2_COURSE_KIT_NAMESPACES", "")  # what is found is kept there, and afterwards as it was
    monkeypatch.delenv("ROS2_COURSE_KIT_NAMESPACES")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(GraderError, match="bubblewrap"):
        sandbox.require()


def test_unsafe_gradings_keep_what_keeps_the_host_alive(monkeypatch: pytest.MonkeyPatch):
    """A worker that kills "every process but itself" must not reach the host's."""
    monkeypatch.setenv(namespaces.UNSAFE_VARIABLE, "1")
    assert python("import os; print(os.getpid() < 10)").output == "True\n"
    assert python("open('/usr/evil', 'w')").exit_code == 1
    assert namespaces.private_network(["true"]) == ["true"]


@pytest.mark.slow  # a whole grading
@pytest.mark.ros
def test_a_grading_without_a_sandbox_says_so_in_every_report(
    reference: Path, tmp_path: Path, settings: pipeline.Settings, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv(namespaces.UNSAFE_VARIABLE, "1")
    grading = pipeline.grade(reference, tmp_path, replace(settings, requirements=("F14",)))
    as_json, page = report.write(grading, tmp_path, pictures=False)
    for text in (as_json.read_text(), page.read_text(), " ".join(console.render(grading).split())):
        assert "Graded with --unsafe-no-sandbox" in text
        assert "can be trusted no more than the submission" in text
