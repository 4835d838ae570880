"""Programs to be started in a sandbox, by a fork or by a start of Python, and what they can ask about themselves."""

from __future__ import annotations

import textwrap
import time
from pathlib import Path

from grader import sandbox
from grader.host import ros_env

INSTALL = Path("/ws/install")
ENVIRONMENT = ros_env.environment(INSTALL, home=sandbox.HOME) | {"PYTHONFAULTHANDLER": "1"}
LIMITS = sandbox.Limits(wall_seconds=60.0)

# Ended with SIGSEGV in nearly every fork whose LTTng believed that its threads were there: docs/ros-from-wheels.md.
ENDS_WITH_MANY_STACKS = """
    import threading
    import rclpy.node
    together = threading.Barrier(32)
    threads = [threading.Thread(target=together.wait) for _ in range(32)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print("done", flush=True)
"""

# Everything that a program can ask about itself, without what differs between two starts of the same program.
ABOUT_ITSELF = """
    import gc, json, os, re, resource, signal, sys, threading

    def lines(path):
        with open(path) as stream:
            return stream.read().splitlines()

    status = dict(line.split(":", 1) for line in lines("/proc/self/status"))
    kept = ("Name", "Umask", "State", "Groups", "NoNewPrivs", "Seccomp", "Seccomp_filters", "CapInh", "CapPrm",
            "CapEff", "CapAmb", "SigBlk", "SigIgn", "Cpus_allowed_list")
    print(json.dumps({
        "status": {name: status[name].strip() for name in kept},
        "has one user and group": len(set(status["Uid"].split() + status["Gid"].split())) == 1,
        "is root": os.getuid() == 0,
        "owns its /proc": os.stat("/proc/self/fd").st_uid == os.getuid(),
        "limits": {name: resource.getrlimit(getattr(resource, name)) for name in dir(resource) if "RLIMIT" in name},
        "host name": os.uname().nodename,
        "descriptors": {fd: re.sub(r"\\d+", "", os.readlink(f"/proc/self/fd/{fd}")) for fd in ("0", "1", "2")},
        "number of descriptors": len(os.listdir("/proc/self/fd")),
        "mounts": sorted(line.split(" ", 4)[4].split(" - ")[0] for line in lines("/proc/self/mountinfo")),
        "cwd": os.getcwd(),
        "root": os.readlink("/proc/self/root"),
        "cmdline": lines("/proc/self/cmdline"),
        "environ": sorted(lines("/proc/self/environ")[0].split("\\0")),
        "environment": sorted(os.environ.items()),
        "argv": sys.argv, "orig_argv": sys.orig_argv, "executable": sys.executable, "flags": list(sys.flags),
        "path": sys.path, "prefix": [sys.prefix, sys.exec_prefix, sys.base_prefix],
        "main": {name: str(value) for name, value in vars(sys.modules["__main__"]).items() if name in (
            "__name__", "__file__", "__doc__", "__package__", "__spec__", "__cached__")},
        "builtins": repr(__builtins__),
        "thread": [threading.current_thread().name, threading.active_count()],
        "handlers": [str(signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGPIPE,
            signal.SIGCHLD, signal.SIGABRT)],
        "streams": [[stream.encoding, stream.errors, stream.line_buffering, stream.write_through]
            for stream in (sys.stdout, sys.stderr)],
        "collects garbage": [gc.isenabled(), gc.get_freeze_count()],
        "recursion limit": sys.getrecursionlimit(),
        "imports numpy": "numpy" in sys.modules or bool(__import__("numpy")),
    }))
"""


def write(install: Path, text: str, name: str = "node", first: str = "#!/usr/bin/env python3") -> list[str]:
    """Write a program into the install tree, and return its command line in the sandbox."""
    path = install / "lib" / "pkg" / name
    path.write_text(f"{first}\n{textwrap.dedent(text)}")
    path.chmod(0o755)
    return [str(INSTALL / "lib" / "pkg" / name), "--ros-args", "-p", "a:=b c"]


def box(install: Path) -> sandbox.Sandbox:
    environment = {**ENVIRONMENT, "ROS_DOMAIN_ID": "7"}
    return sandbox.Sandbox(read_only={install: str(INSTALL)}, environment=environment, network=True)


def ended(process: sandbox.Process) -> tuple[int | None, str]:
    """Return a program's exit status and output once it has ended."""
    code = process.wait(60.0)
    process.kill()
    return code, process.output


def await_output(process: sandbox.Process, text: str) -> None:
    deadline = time.monotonic() + 60.0
    while text not in process.output:
        assert process.exit_code() is None, process.output
        assert time.monotonic() < deadline, process.output
        time.sleep(0.005)
