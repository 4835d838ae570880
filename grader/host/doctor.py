"""Check what this machine has and lacks for grading, and name the command that fixes each lack. Changes nothing."""

from __future__ import annotations

import sys
import sysconfig
import tempfile
import textwrap
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from grader import KIT
from grader.errors import EXIT_GRADED, EXIT_OUR_FAULT
from grader.host import namespaces, ros_env, shortage
from grader.host.machine import Machine, install_line

GB = 1024**3
# Enough for a build with two compilers and for a trial.
LOW_MEMORY, LOW_DISK = 2 * GB, 2 * GB
NO_DISK = GB // 4
# Starting two nodes takes a second on an idle machine, ten with every core loaded.
DDS_SECONDS = 30.0
REINSTALL = "rm -rf .venv && make setup"
ELSEWHERE = "cannot be configured here; grade an export of the platform with `grader batch` on another machine"
WRITABLE = "docker run --tmpfs /tmp:exec --tmpfs /var/tmp:exec ...  (a sandbox needs both)"
# What a sandbox sets as the limits of its processes; no limit of the grader's may be lower.
LIMITS = {"NPROC": 512, "NOFILE": 1024, "AS": 4096 * 1024**2, "FSIZE": 256 * 1024**2}


class State(Enum):
    """The state of one thing: fine, usable with limits, or missing."""

    OK = "ok"
    WARN = "warn"
    BAD = "bad"


@dataclass(frozen=True)
class Diagnosis:
    """The result of one check. `fix` is the command that corrects it, empty if nothing is wrong."""

    name: str
    state: State
    found: str
    fix: str = ""


def _ok(name: str, found: str) -> Diagnosis:
    return Diagnosis(name, State.OK, found)


def _warn(name: str, found: str, fix: str = "") -> Diagnosis:
    return Diagnosis(name, State.WARN, found, fix)


def _bad(name: str, found: str, fix: str) -> Diagnosis:
    return Diagnosis(name, State.BAD, found, fix)


def examine(machine: Machine | None = None) -> list[Diagnosis]:
    """Return the diagnoses of `machine`, by default this one. Takes about three seconds."""
    machine = machine or Machine()
    with ThreadPoolExecutor(max_workers=2) as pool:
        lists = pool.map(lambda check: check(machine), _CHECKS)
        return [diagnosis for found in lists for diagnosis in found]


def examine_sandbox(machine: Machine | None = None) -> list[Diagnosis]:
    """Return only the diagnoses of the sandbox: bubblewrap, networks, the submissions' user, cgroups."""
    machine = machine or Machine()
    return [*_sandbox(machine), *_user(machine), *_cgroups(machine)]


def exit_status(diagnoses: list[Diagnosis]) -> int:
    """Return 0 if everything that grading needs is there, else 3."""
    return EXIT_OUR_FAULT if any(diagnosis.state is State.BAD for diagnosis in diagnoses) else EXIT_GRADED


def render(diagnoses: list[Diagnosis]) -> str:
    """Return the diagnoses as text for a console: one line each, and one more for a fix."""
    width = max((len(diagnosis.name) for diagnosis in diagnoses), default=0)
    lines = []
    for diagnosis in diagnoses:
        lines.append(f"{diagnosis.state.value:<5} {diagnosis.name:<{width}}  {diagnosis.found}")
        if diagnosis.fix:
            lines.append(f"{'':<5} {'':<{width}}  fix: {diagnosis.fix}")
    bad = [diagnosis.name for diagnosis in diagnoses if diagnosis.state is State.BAD]
    instead = (each.found.partition(":")[0] for each in diagnoses if each.name == "instead of namespaces")
    how = f"This machine can grade (confinement: {next(instead, 'namespaces')})."
    lines.append(f"This machine cannot grade yet: {', '.join(bad)}." if bad else how)
    return "\n".join(lines)


# -- tools and packages -------------------------------------------------------------------------------------------


def _compilers(machine: Machine) -> list[Diagnosis]:
    return [_compiler(machine, "C", "stdio.h"), _compiler(machine, "C++", "string")]


def _compiler(machine: Machine, language: str, header: str) -> Diagnosis:
    name, fix = f"{language} compiler", install_line(machine, ["compiler"])
    tool = next(filter(machine.which, ros_env.COMPILERS[name]), None)
    if tool is None:
        return _bad(name, "not found", fix)
    source = f"#include <{header}>\nint main(void) {{ return 0; }}\n"
    with tempfile.TemporaryDirectory() as folder:
        ran = machine.run([tool, "-x", language.lower(), "-", "-o", f"{folder}/program"], 20, text=source)
    if not ran.ok:
        return _bad(name, f"{tool} does not compile a one-line program: {_last_line(ran.output)}", fix)
    return _ok(name, f"{tool} compiles")


def _build_tools(machine: Machine) -> list[Diagnosis]:
    diagnoses = []
    for tool in ("make", "prlimit", "cmake", "ninja"):
        beside = str(Path(sys.executable).with_name(tool))
        path = beside if machine.exists(beside) else machine.which(tool)
        package = {"make": "make", "prlimit": "util-linux"}.get(tool)
        fix = install_line(machine, [package]) if package else ".venv/bin/python -m pip install -r requirements.txt"
        diagnoses.append(_ok(tool, path) if path else _bad(tool, "not found", fix))
    return diagnoses


def _headers(machine: Machine) -> list[Diagnosis]:
    path = f"{sysconfig.get_path('include')}/Python.h"
    if machine.exists(path):
        return [_ok("Python headers", path)]
    python = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    return [_bad("Python headers", f"{path} does not exist", install_line(machine, ["headers"], python))]


def _ccache(machine: Machine) -> list[Diagnosis]:
    path = machine.which("ccache")
    if path:
        return [_ok("ccache", path)]
    return [_warn("ccache", "not found; first builds take twice as long", install_line(machine, ["ccache"]))]


def _rclpy(machine: Machine) -> list[Diagnosis]:
    with tempfile.TemporaryDirectory() as home:
        environment = ros_env.environment(home=Path(home))
        program = "import rclpy, std_msgs.msg, rosidl_parser.parser; print('fine')"
        ran = machine.run([sys.executable, "-P", "-c", program], 20, environment)
    if ran.output.endswith("fine"):
        return [_ok("import rclpy", "works in a clean process, and so does rosidl's parser")]
    return [_bad("import rclpy", _last_line(ran.output), REINSTALL)]


# -- the sandbox --------------------------------------------------------------------------------------------------


def _sandbox(machine: Machine) -> list[Diagnosis]:
    """Try bubblewrap, bubblewrap inside it, and DDS inside that; where the first fails, what is used instead."""
    name = "bubblewrap"
    if machine.which("bwrap") is None:
        return _without_namespaces(machine, "not found", install_line(machine, ["bubblewrap"]))
    ran = machine.run([*namespaces.SANDBOX, "true"], 5)
    if not ran.ok:
        return _without_namespaces(machine, *_why_bubblewrap_fails(machine, _last_line(ran.output)))
    return [_ok(name, "isolates processes, users and the network"), _nested(machine), _dds(machine)]


def _without_namespaces(machine: Machine, reason: str, fix: str) -> list[Diagnosis]:
    """Return what a grading does where bubblewrap does not work: root's other users, or the student's own checks."""
    name, instead = "bubblewrap", "instead of namespaces"
    if lacks := machine.lacks_for_other_users():
        fixes = {
            "not installed": install_line(machine, ["proot"]),
            "cannot enter": "rm -rf .venv && make setup PYTHON=/usr/bin/python3",
            "id": ELSEWHERE,
        }
        more = next((fix for word, fix in fixes.items() if word in lacks.split(", ")[0]), WRITABLE)
        return [_bad(name, reason, fix), _bad(instead, f"nothing: {lacks}", more)]
    if machine.root:
        return [
            _warn(name, reason, fix),
            _warn(instead, "users: each sandbox has a user of its own (docs/containers.md)"),
        ]
    return [
        _bad(name, reason, fix),
        _warn(instead, "none: `grader check` works on your own package; no points are given"),
    ]


def _why_bubblewrap_fails(machine: Machine, message: str) -> tuple[str, str]:
    """Return the reason why bubblewrap fails here, and the fix."""
    sudo = "" if machine.root else "sudo "
    for setting, forbids, allows in (
        ("kernel.apparmor_restrict_unprivileged_userns", "1", "0"),
        ("kernel.unprivileged_userns_clone", "0", "1"),
        ("user.max_user_namespaces", "0", "15000"),
    ):
        value = machine.read("/proc/sys/" + setting.replace(".", "/"))
        if value is not None and value.strip() == forbids:
            return f"{setting} is {forbids}, which forbids it ({message})", f"{sudo}sysctl -w {setting}={allows}"
    pod = machine.exists("/var/run/secrets/kubernetes.io")
    if pod or machine.exists("/.dockerenv") or machine.exists("/run/.containerenv"):
        return f"this {'pod' if pod else 'container'} forbids it ({message})", _container_fix(machine, pod=pod)
    return (
        f"does not work ({message})",
        f"{' '.join(namespaces.SANDBOX)} true  (shows the reason; a container or a kernel setting forbids it)",
    )


def _container_fix(machine: Machine, *, pod: bool) -> str:
    """Return how to start this container so that bubblewrap works: without what it has already."""
    confined = {
        "seccomp": "\nSeccomp:\t0" not in (machine.read("/proc/self/status") or ""),
        "apparmor": (machine.read("/proc/self/attr/current") or "unconfined").strip() != "unconfined",
        "systempaths": " /proc/" in (machine.read("/proc/self/mountinfo") or ""),
    }
    missing = [name for name, holds in confined.items() if holds]
    if not missing:
        return ELSEWHERE
    if pod:
        wanted = {"seccomp": "seccompProfile: {type: Unconfined}", "apparmor": "appArmorProfile: {type: Unconfined}"}
        wanted |= {"systempaths": "procMount: Unmasked"}
        return f"in the pod: securityContext: {{{', '.join(wanted[each] for each in missing)}}}  (docs/containers.md)"
    options = " ".join(f"--security-opt {name}=unconfined" for name in missing)
    return f"docker run {options} ...  (restart the container like this)"


def _nested(machine: Machine) -> Diagnosis:
    name = "nested bubblewrap"
    ran = machine.run(namespaces.private_network([*namespaces.NODE_SANDBOX, "true"]), 5)
    if ran.ok:
        return _ok(name, "works; a node's sandbox can join its trial's network")
    return _bad(name, *_why_bubblewrap_fails(machine, _last_line(ran.output)))


_LISTENER = """
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("doctor_listener")
heard = []
node.create_subscription(String, "doctor", heard.append, 10)
print("ready", flush=True)
while not heard:
    rclpy.spin_once(node, timeout_sec=0.1)
"""
# The time for a message starts when both are ready: a slow start on a busy machine must not look like a lost message.
_TALKER = """
import subprocess, sys, time, rclpy
from std_msgs.msg import String
listener = subprocess.Popen(sys.argv[1:], stdout=subprocess.PIPE)
rclpy.init()
node = rclpy.create_node("doctor_talker")
publisher = node.create_publisher(String, "doctor", 10)
ready = listener.stdout.readline()
end = time.monotonic() + 4
while ready and listener.poll() is None:
    if time.monotonic() > end:
        sys.exit("no message within 4 s")
    publisher.publish(String(data="hello"))
    time.sleep(0.02)
sys.exit(listener.wait())
"""


def _dds(machine: Machine) -> Diagnosis:
    """Run two nodes in a network of their own, the listener in a sandbox like a student's node."""
    name = "DDS in a network namespace"
    logs = ("--setenv", "ROS_LOG_DIR", "/run/ros-log")
    listener = [*namespaces.NODE_SANDBOX[:-1], *logs, "--", sys.executable, "-P", "-c", _LISTENER]
    with tempfile.TemporaryDirectory() as home:
        ran = machine.run(
            namespaces.private_network([sys.executable, "-P", "-c", _TALKER, *listener]),
            DDS_SECONDS,
            ros_env.environment(home=Path(home)),
        )
    if ran.ok:
        return _ok(name, "messages reach a sandbox")
    fix = f"{' '.join(namespaces.private_network(['ip', 'address', 'show', 'lo']))}  (lo must be UP, with 127.0.0.1)"
    return _bad(name, f"no message reached a sandbox: {_last_line(ran.output)}", fix)


def _user(machine: Machine) -> list[Diagnosis]:
    """Try as whom a submission runs: root's sandboxes write a file of root's, as another user."""
    name = "submissions run as"
    if not machine.root:
        return [_ok(name, "you; what belongs to others is out of their reach")]
    if machine.which("bwrap") is None or not machine.run([*namespaces.SANDBOX, "true"], 5).ok:
        return []  # said already: another user, or nothing works
    if not (refusal := machine.refuses_other_user()):
        return [_ok(name, "a user that owns nothing; a file of root's could not be written in a sandbox")]
    return [_warn(name, f"root, for root cannot give them another user here: {refusal}", "grade as an ordinary user")]


def _cgroups(machine: Machine) -> list[Diagnosis]:
    """Look for cgroups in the way a grading does. Without them, resource limits do.

    This creates a group and removes it; with version 2 it also moves this process into one, as a grading does.
    """
    name = "cgroups"
    hierarchy = machine.cgroups()
    if hierarchy is not None:
        folders = ", ".join(sorted({str(folder) for folder in hierarchy.folders.values()}))
        return [_ok(name, f"version {hierarchy.version}, below {folders}")]
    instead = "resource limits are used instead"
    grade = ".venv/bin/grader grade SUBMISSION --out out/NAME"
    if machine.exists("/sys/fs/cgroup/cgroup.controllers"):
        fix = f"systemd-run --user --scope -p Delegate=yes {grade}"
        return [_warn(name, f"version 2, memory and pids are not delegated; {instead}", fix)]
    missing = [each for each in ("memory", "pids") if not machine.exists(f"/sys/fs/cgroup/{each}")]
    if missing:
        return [_warn(name, f"none for {' and '.join(missing)}; {instead}")]
    fix = f"sudo -E {grade}" if machine.which("sudo") and not machine.root else ""
    return [_warn(name, f"version 1, not writable; {instead}", fix)]


def _limits(machine: Machine) -> list[Diagnosis]:
    """Compare the limits that hold here with those of a sandbox, which cannot raise them."""
    low = [f"{name} {have}" for name, need in LIMITS.items() if 0 <= (have := machine.limit(name)) < need]
    if low:
        needed = ", ".join(f"{name} {need}" for name, need in LIMITS.items())
        fix = "raise it where this session was started: ulimit -H, docker run --ulimit nproc=4096:4096, limits.conf"
        return [_bad("limits", f"{', '.join(low)}; a sandbox needs {needed}", fix)]
    if (most := machine.process_limit()) < LIMITS["NPROC"]:
        fix = f"docker run --pids-limit={LIMITS['NPROC']} ..., or the kubelet's podPidsLimit"
        found = f"{most} processes in this container; a grading needs up to {LIMITS['NPROC']}"
        return [(_bad if most < shortage.FEW_PROCESSES else _warn)("limits", found, fix)]
    return [_ok("limits", "none is below a sandbox's own")]


# -- memory and disk ----------------------------------------------------------------------------------------------


def _resources(machine: Machine) -> list[Diagnosis]:
    memory, free = shortage.free_memory(machine.read), machine.free_bytes(str(KIT))
    low_memory = f"{memory / GB:.1f} GB available; 2 GB are recommended"
    low_disk = f"{free / GB:.1f} GB free; 2 GB are recommended"
    return [
        _ok("memory", f"{memory / GB:.1f} GB available")
        if memory >= LOW_MEMORY
        else _warn("memory", low_memory, "ps axo rss,comm --sort -rss | head"),
        _ok("disk", f"{free / GB:.1f} GB free")
        if free >= LOW_DISK
        else (_warn if free >= NO_DISK else _bad)("disk", low_disk, "make clean"),
    ]


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return textwrap.shorten(lines[-1], 300, placeholder=" ...") if lines else "no message"


# In the order of the report. Two run at a time.
_CHECKS: tuple[Callable[[Machine], list[Diagnosis]], ...] = (
    _compilers, _build_tools, _headers, _rclpy, _sandbox, _user, _cgroups, _limits,
    _resources, _ccache,
)  # fmt: skip
