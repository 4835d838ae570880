"""Run Python programs in sandboxes that are set up already, each as a fork of this process, which has imported much.

Started by `warm_start`, outside of the sandboxes, with the path of `warm_imports`; imports nothing else of the grader
and runs nothing of a submission.
A request is a message on standard input: JSON, and three file descriptors. For each request two processes are forked.
The first joins the sandbox's namespaces and waits; the second gives up every right that a sandbox's own commands have
not, and becomes the program. See setns(2), capabilities(7), seccomp(2) and, for what /proc shows, prctl(2).

A launch starts programs of its own. Before it becomes the launch, its process forks a spare one, inside the sandbox and
with no more rights, of which these programs are forked in turn (`offer_forks`, grader/ros2/launching/forked.py).
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import gc
import importlib
import importlib.machinery
import json
import mmap
import os
import resource
import runpy
import signal
import socket
import struct
import sys
import types
from typing import Any

_MESSAGE_BYTES = 65536
_STREAMS = 3  # of a program: standard input, output and error
LOADED = b"loaded"  # a request for the names of the modules that this process has imported, instead of a program
# <linux/sched.h>, <linux/nsfs.h>, <linux/capability.h>, <linux/prctl.h>
_NEW_USER = 0x10000000
_OWNER_OF_NAMESPACE = 0xB701
_CAPABILITIES_3, _CAPABILITIES = 0x20080522, 64
_DIE_WITH_PARENT = 1
_SET_DUMPABLE, _SET_SECCOMP, _DROP_FROM_BOUNDING_SET, _SET_NO_NEW_PRIVILEGES, _AMBIENT = 4, 22, 24, 38, 47
_CLEAR_AMBIENT, _SECCOMP_FILTER = 4, 2
_KEYCTL, _JOIN_SESSION_KEYRING = 250, 1  # <asm/unistd_64.h>, <linux/keyctl.h>
_SET_MEMORY_MAP, _WHOLE_MAP = 35, 14
# The fields of /proc/self/stat that struct prctl_mm_map asks for; see proc(5).
_START_CODE, _END_CODE, _START_STACK, _START_DATA, _END_DATA, _START_BRK = 26, 27, 28, 45, 46, 47

_SHARED_BY_LTTNG = "/dev/shm/lttng-ust-wait-6"  # the last number is that of liblttng-ust's ABI, in its strings

_libc = ctypes.CDLL(None, use_errno=True)
_shown: list[mmap.mmap] = []  # what /proc shows lies in it for as long as the process lives
_signals = ctypes.create_string_buffer(128)  # a sigset_t: which signals were blocked before a fork


def serve() -> dict[str, Any]:
    """Serve requests until nobody can send any more; in a process that becomes a program, return its request."""
    with contextlib.closing(socket.socket(fileno=os.dup(0))) as channel:
        loaded = json.dumps(sorted({name.split(".")[0] for name in sys.modules})).encode()
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel forgets those that have ended
        while True:
            data, descriptors, _, _ = socket.recv_fds(channel, _MESSAGE_BYTES, 3)
            if not data:
                os._exit(0)
            if data == LOADED:
                os.write(descriptors[0], loaded)
            elif fork() == 0:
                break
            for descriptor in descriptors:
                os.close(descriptor)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    status, output, _hold = descriptors  # the third one is open elsewhere until this process ends
    request: dict[str, Any] = json.loads(data)
    try:
        join_and_wait(request, status)
    except BaseException as error:
        tell(status, f"{type(error).__name__}: {error}")
        os._exit(1)
    take_streams(output)
    kept = {name: request[name] for name in ("command", "cwd", "environment", "libraries")}
    return offer_forks(kept, request["offers_forks"]) if request["offers_forks"] else kept


def fork() -> int:
    """Fork, and return the child's pid, 0 in the child; in that, all signals are blocked until `restart_lttng`.

    rclpy is linked to LTTng, which has started two threads; they sleep until a tracing daemon comes. A fork does not
    have them, and yet LTTng cancels them when the program exits: a crash, if their memory is not mapped any more.
    """
    _call_lttng("ust_before_fork")
    if (pid := os.fork()) != 0:
        _call_lttng("ust_after_fork_parent")
    return pid


def restart_lttng() -> None:
    """Start LTTng's threads in a process that descends from one that was forked by `fork`.

    Where its shared memory is missing, each of them forks a child that makes it, and waits for any child to end: it may
    be one that the program has just started, whose exit status is lost then. So it is made here.
    """
    for name in (_SHARED_BY_LTTNG, f"{_SHARED_BY_LTTNG}-{os.getuid()}"):
        with contextlib.suppress(OSError), open(name, "ab") as shared:  # noqa: PTH123
            shared.truncate(mmap.PAGESIZE)
    _call_lttng("ust_after_fork_child")


def _call_lttng(name: str) -> None:
    """Call a function of lttng/ust-fork.h, if rclpy's libraries have been loaded and are linked to LTTng."""
    with contextlib.suppress(OSError, AttributeError):
        getattr(ctypes.CDLL("librcl.so", os.RTLD_NOLOAD), name)(_signals)


def join_and_wait(request: dict[str, Any], status: int) -> None:
    """Join the sandbox and fork; return in the child, which has the rights of a program in the sandbox.

    The parent writes the child's pid to `status`, and how it ended.
    """
    groups = [os.open(path, os.O_WRONLY) for path in request["groups"]]
    join_namespaces(request["init"])
    read_end, write_end = os.pipe()
    pid = os.fork()
    if pid == 0:
        for group in groups:
            os.write(group, b"0")
        os.setsid()
        give_up_rights(request)
        os.write(write_end, b"+")
        return
    os.close(write_end)
    if os.read(read_end, 1):  # else the child has said why not
        tell(status, str(pid))
    _, ended = os.waitpid(pid, 0)
    tell(status, str(os.waitstatus_to_exitcode(ended)))
    os._exit(0)


def tell(status: int, line: str) -> None:
    """Write a line to who asked for the program, unless that is gone: a grading may be interrupted."""
    with contextlib.suppress(BrokenPipeError):
        os.write(status, f"{line}\n".encode())


def join_namespaces(init: int) -> None:
    """Enter the namespaces of the process `init`, the first one of a sandbox; its pid namespace with the next fork."""
    names = ("user", "net", "mnt", "ipc", "uts", "cgroup", "pid")
    found = {name: os.open(f"/proc/{init}/ns/{name}", os.O_RDONLY) for name in names}
    own = {name: os.open(f"/proc/self/ns/{name}", os.O_RDONLY) for name in names}
    others = [name for name in names[1:] if not os.path.sameopenfile(found[name], own[name])]
    current = own["user"]
    for name in others:
        # Of the user namespaces one in another, the outermost owns the network, the next one what bubblewrap has
        # mounted and the other namespaces, and the innermost is that of the sandbox's commands.
        current = enter(fcntl.ioctl(found[name], _OWNER_OF_NAMESPACE), current)
        _call("setns", found[name], 0)
    enter(found["user"], current)


def enter(wanted: int, current: int) -> int:
    """Enter a user namespace unless it is the current one, and return it."""
    if not os.path.sameopenfile(wanted, current):
        _call("setns", wanted, _NEW_USER)
    return wanted


def leave_keyring() -> None:
    """Give this thread, and so what it starts, an empty session keyring of its own; a kernel without any refuses."""
    _libc.syscall(_KEYCTL, _JOIN_SESSION_KEYRING, None)


def set_dumpable(wanted: bool) -> None:
    """Let this process's memory and descriptors be open to processes of the same user, as by default, or not."""
    _call("prctl", _SET_DUMPABLE, int(wanted), 0, 0, 0)


def give_up_rights(request: dict[str, Any]) -> None:
    """Give up what a command in a sandbox does not have: keys, limits, user, capabilities, kernel calls."""
    leave_keyring()
    for name, value in request["limits"].items():
        resource.setrlimit(getattr(resource, name), (value, value))
    for number in range(_CAPABILITIES):
        _libc.prctl(_DROP_FROM_BOUNDING_SET, number, 0, 0, 0)  # fails above the last one that this kernel has
    if (user := request["user"]) is not None:
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    _call("prctl", _AMBIENT, _CLEAR_AMBIENT, 0, 0, 0)
    _call("capset", struct.pack("=Ii", _CAPABILITIES_3, 0), bytes(24))
    set_dumpable(True)  # as after the start of a program: what /proc/self shows is its own
    _call("prctl", _SET_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    if not request["filter"]:
        return
    program = ctypes.create_string_buffer(bytes.fromhex(request["filter"]))
    length = len(request["filter"]) // 16  # instructions of eight bytes
    _call("prctl", _SET_SECCOMP, _SECCOMP_FILTER, struct.pack("@HP", length, ctypes.addressof(program)), 0, 0)


def take_streams(output: int) -> None:
    """Read nothing, write to `output`, and close every other file descriptor."""
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.closerange(3, 65536)


def offer_forks(program: dict[str, Any], variable: str) -> dict[str, Any]:
    """Fork a process that forks programs for this one; return, in each program, what it is.

    The environment variable `variable` tells the first program the number of its end of a socket. A request on that is
    JSON and three file descriptors, for the streams of the new program; the answer is its pid.
    """
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    launch = os.getpid()
    if os.fork() != 0:
        theirs.close()
        return program | {"environment": {**program["environment"], variable: str(ours.detach())}}
    ours.close()
    die_with(launch)
    set_dumpable(False)
    while True:
        data, streams, _, _ = socket.recv_fds(theirs, _MESSAGE_BYTES, _STREAMS)
        if not data:
            os._exit(0)
        if len(streams) != _STREAMS:
            continue
        if (pid := fork_for(launch)) == 0:
            break
        theirs.send(b"%d" % pid)
        for stream in streams:
            os.close(stream)
    set_dumpable(True)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    os.closerange(3, 65536)
    asked: dict[str, Any] = json.loads(data)
    return program | asked


def fork_for(launch: int) -> int:
    """Fork a process that leads a session and dies with its new parent `launch`; return its pid, and 0 in it.

    Its first parent, between this process and it, has ended when it begins. See PR_SET_CHILD_SUBREAPER in prctl(2).
    """
    (pid_read, pid_write), (over_read, over_write) = os.pipe(), os.pipe()
    between = os.fork()
    if between == 0:
        if (pid := os.fork()) != 0:
            os.write(pid_write, b"%d" % pid)
            os._exit(0)
        os.setsid()
        os.close(pid_write)
        os.close(over_write)
        os.read(over_read, 1)
        die_with(launch)
        return 0
    os.close(pid_write)
    with os.fdopen(pid_read, "rb") as written:
        found = int(written.read())  # until the process between has written it, and the new one leads a session
    os.waitpid(between, 0)
    os.close(over_write)
    os.close(over_read)
    return found


def die_with(parent: int) -> None:
    """Let the kernel kill this process as soon as its parent ends."""
    _call("prctl", _DIE_WITH_PARENT, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it has ended before
        os._exit(1)


def become_program(request: dict[str, Any]) -> types.CodeType:
    """Make this process look as if Python had just been started with a script, and return the script's code."""
    script, *arguments = request["command"]
    is_folder = os.path.isdir(script)  # noqa: PTH112
    file = f"{script}/__main__.py" if is_folder else script
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["environment"])
    restart_lttng()
    sys.argv[:] = [script, *arguments]
    sys.orig_argv[:] = ["python3", script, *arguments]
    with contextlib.suppress(OSError):  # a kernel without CONFIG_CHECKPOINT_RESTORE
        show_in_proc(sys.orig_argv, request["environment"])
    sys.path[0] = script if is_folder else os.path.dirname(os.path.realpath(script))  # noqa: PTH120
    sys.path_importer_cache.clear()  # it has noted that the sandbox's folders do not exist
    load(request["libraries"])
    sys.modules.pop("sitecustomize", None)
    with contextlib.suppress(ImportError):
        importlib.import_module("sitecustomize")  # as Python does at its start
    sys.excepthook = without_our_frames
    main = types.ModuleType("__main__")
    loader = importlib.machinery.SourceFileLoader("__main__", file)
    main.__dict__.update(
        __annotations__={}, __builtins__=__builtins__, __cached__=None, __file__=file, __loader__=loader
    )
    sys.modules["__main__"] = main
    gc.unfreeze()
    with open(file, "rb") as stream:  # noqa: PTH123
        return compile(stream.read(), file, "exec", dont_inherit=True)


def show_in_proc(words: list[str], environment: dict[str, str]) -> None:
    """Let /proc/self/cmdline and /proc/self/environ show these."""
    texts = [words, [f"{name}={value}" for name, value in environment.items()]]
    shown = [b"".join(os.fsencode(text) + b"\0" for text in each) for each in texts]
    # /proc shows anonymous memory only.
    memory = mmap.mmap(-1, sum(map(len, shown)), flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    memory.write(b"".join(shown))
    _shown.append(memory)
    start = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    between, end = start + len(shown[0]), start + len(memory)
    with open("/proc/self/stat", "rb") as stream:  # noqa: PTH123
        _state, *numbers = stream.read().rpartition(b")")[2].split()
    fields = [0, 0, 0, 0, *map(int, numbers)]
    _libc.sbrk.restype = ctypes.c_void_p
    borders = [fields[number] for number in (_START_CODE, _END_CODE, _START_DATA, _END_DATA, _START_BRK)]
    borders += [_libc.sbrk(0), fields[_START_STACK], start, between, between, end]
    whole = struct.pack("@11QQII", *borders, 0, 0, 0xFFFFFFFF)  # no new auxiliary vector, no other executable
    _call("prctl", _SET_MEMORY_MAP, _WHOLE_MAP, whole, len(whole), 0)


def load(libraries: list[str]) -> None:
    """Load shared libraries, in this order.

    The loader has noted that their folder does not exist, outside of the sandbox. What is loaded it finds by name.
    """
    for library in libraries:
        with contextlib.suppress(OSError):
            ctypes.CDLL(library)


def without_our_frames(kind: type[BaseException], error: BaseException, trace: types.TracebackType | None) -> None:
    """Print an exception that nothing has caught as Python does, from the program's first line on."""
    while trace is not None and trace.tb_frame.f_code.co_filename == __file__:
        trace = trace.tb_next
    sys.__excepthook__(kind, error.with_traceback(trace), trace)


def _call(name: str, *arguments: Any) -> None:
    if getattr(_libc, name)(*arguments) != 0:
        raise OSError(ctypes.get_errno(), f"{name}: {os.strerror(ctypes.get_errno())}")


if __name__ == "__main__":
    runpy.run_path(sys.argv[1])["import_modules"]()
    gc.collect()
    gc.freeze()  # a fork that never touches these pages never copies them
    set_dumpable(False)
    exec(become_program(serve()), sys.modules["__main__"].__dict__)
