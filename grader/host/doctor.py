"""Say, thing by thing, what this machine has and lacks for grading, and what mends each. Changes nothing."""

from __future__ import annotations

import importlib.metadata
import re
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from grader import KIT
from grader.host import namespaces, ros_env
from grader.host.machine import Host, install_line

GB = 1024**3
# CPython releases for which all the ROS 2 wheels exist.
OLDEST, NEWEST = (3, 11), (3, 14)
# A build with two compilers at work and a trial fit into this.
LITTLE_MEMORY, LITTLE_DISK = 2 * GB, 2 * GB
NO_DISK = GB // 4
# Starting two nodes takes a second on an idle machine, ten on one whose every core is loaded.
DDS_SECONDS = 30.0
AGAIN = "rm -rf .venv && make setup"


class State(Enum):
    """How a thing is: as it should be, usable with less, or missing."""

    OK = "ok"
    WARN = "warn"
    BAD = "bad"


@dataclass(frozen=True)
class Diagnosis:
    """One thing that was looked at. `fix` is the command that puts it right, empty when it is."""

    name: str
    state: State
    found: str
    fix: str = ""


def examine(host: Host | None = None) -> list[Diagnosis]:
    """Return what was found on `host`, by default this machine. Takes about three seconds."""
    seen = host or Host()
    with ThreadPoolExecutor(max_workers=2) as pool:
        lists = pool.map(lambda look: look(seen), _LOOKS)
        return [diagnosis for found in lists for diagnosis in found]


def defences(host: Host | None = None) -> list[Diagnosis]:
    """Return what was found of the walls around submissions alone."""
    seen = host or Host()
    return [*_walls(seen), *_cgroups(seen)]


def exit_status(diagnoses: list[Diagnosis]) -> int:
    """Return 0 when everything that grading needs is there, else 3."""
    return 3 if any(diagnosis.state is State.BAD for diagnosis in diagnoses) else 0


def render(diagnoses: list[Diagnosis]) -> str:
    """Return the diagnoses as text for a console, one line each and one more where something is to be done."""
    width = max((len(diagnosis.name) for diagnosis in diagnoses), default=0)
    lines = []
    for diagnosis in diagnoses:
        lines.append(f"{diagnosis.state.value:<5} {diagnosis.name:<{width}}  {diagnosis.found}")
        if diagnosis.fix:
            lines.append(f"{'':<5} {'':<{width}}  fix: {diagnosis.fix}")
    bad = [diagnosis.name for diagnosis in diagnoses if diagnosis.state is State.BAD]
    lines.append(f"This machine cannot grade yet: {', '.join(bad)}." if bad else "This machine can grade.")
    return "\n".join(lines)


def _python(_host: Host) -> list[Diagnosis]:
    version = sys.version.split()[0]
    if OLDEST <= sys.version_info[:2] <= NEWEST and sys.implementation.name == "cpython":
        return [Diagnosis("Python", State.OK, version)]
    wanted = f"CPython {'.'.join(map(str, OLDEST))} to {'.'.join(map(str, NEWEST))}"
    return [
        Diagnosis(
            "Python",
            State.BAD,
            f"{sys.implementation.name} {version}; the ROS 2 wheels are for {wanted}",
            "rm -rf .venv && make setup PYTHON=python3.11",
        )
    ]


def _compilers(host: Host) -> list[Diagnosis]:
    fix = install_line(host, ["compiler"])
    return [
        _compiles(host, "C compiler", ("cc", "gcc", "clang"), "c", fix),
        _compiles(host, "C++ compiler", ("c++", "g++", "clang++"), "c++", fix),
    ]


def _compiles(host: Host, name: str, tools: tuple[str, ...], language: str, fix: str) -> Diagnosis:
    tool = next((tool for tool in tools if host.which(tool)), None)
    if tool is None:
        return Diagnosis(name, State.BAD, "not found", fix)
    source = (
        "#include <stdio.h>\nint main(void) { return 0; }\n"
        if language == "c"
        else "#include <string>\nint main() {}\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        ran = host.run([tool, "-x", language, "-", "-o", f"{folder}/it"], 20, text=source)
    if not ran.ok:
        return Diagnosis(name, State.BAD, f"{tool} does not compile a one-line program: {_last_line(ran.output)}", fix)
    return Diagnosis(name, State.OK, f"{tool} compiles")


def _build_tools(host: Host) -> list[Diagnosis]:
    diagnoses = []
    for tool in ("make", "prlimit", "cmake", "ninja"):
        beside = str(Path(sys.executable).with_name(tool))
        path = beside if host.exists(beside) else host.which(tool)
        package = {"make": "make", "prlimit": "util-linux"}.get(tool)
        fix = install_line(host, [package]) if package else _pip("install -r requirements.txt")
        diagnoses.append(Diagnosis(tool, State.OK, path) if path else Diagnosis(tool, State.BAD, "not found", fix))
    return diagnoses


def _headers(host: Host) -> list[Diagnosis]:
    path = f"{sysconfig.get_path('include')}/Python.h"
    if host.exists(path):
        return [Diagnosis("Python headers", State.OK, path)]
    python = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    return [Diagnosis("Python headers", State.BAD, f"{path} is not there", install_line(host, ["headers"], python))]


def _wheels(host: Host) -> list[Diagnosis]:
    pins = host.read(str(KIT / "requirements.txt"))
    installed = _installed()
    fix = _pip("install -r requirements.txt")
    if not any(name.startswith("ros-jazzy-") for name in installed):
        return [Diagnosis("ROS 2 wheels", State.BAD, "not installed", AGAIN)]
    odd = mismatches(installed, pins or "")
    if odd:
        more = f" and {len(odd) - 3} more" if len(odd) > 3 else ""
        return [Diagnosis("ROS 2 wheels", State.BAD, "; ".join(odd[:3]) + more, fix)]
    count = sum(1 for name in installed if name.startswith("ros-jazzy-"))
    against = "the lock and each other" if pins else "each other"
    return [Diagnosis("ROS 2 wheels", State.OK, f"{count} ros-jazzy packages, matching {against}")]


@dataclass(frozen=True)
class Installed:
    """One installed distribution."""

    version: str
    requires: tuple[str, ...] = ()


def mismatches(installed: Mapping[str, Installed], pins: str) -> list[str]:
    """Return how the ROS packages among `installed` (by canonical name) disagree with each other and with `pins`.

    The un-prefixed packages, like ros-std-msgs, are there always: ros-jazzy-std-msgs asks for one version of them.
    Only one of another version, of a newer ROS distribution, breaks things.
    """
    # Imported here: a host on which nothing is installed yet must be able to hear so.
    from packaging.requirements import Requirement

    odd: dict[str, str] = {}
    for name, package in installed.items():
        for text in package.requires if name.startswith("ros-") else ():
            wanted = Requirement(text)
            other = _canonical(wanted.name)
            if not other.startswith("ros-") or (wanted.marker and not wanted.marker.evaluate({"extra": ""})):
                continue
            if other not in installed:
                odd.setdefault(other, f"{other} is missing ({name} needs it)")
            elif not wanted.specifier.contains(installed[other].version, prereleases=True):
                odd.setdefault(other, f"{other} is {installed[other].version}, {name} needs {wanted.specifier}")
    for name, version in re.findall(r"^(ros-[\w.-]+)==([^\s;]+)", pins, re.MULTILINE):
        if name not in installed:
            odd.setdefault(name, f"{name} {version} is missing")
        elif installed[name].version != version:
            odd.setdefault(name, f"{name} is {installed[name].version}, not {version}")
    return [odd[name] for name in sorted(odd)]


def _installed() -> dict[str, Installed]:
    found: dict[str, Installed] = {}
    for distribution in importlib.metadata.distributions():
        name = distribution.metadata["Name"]
        if name:
            found[_canonical(name)] = Installed(distribution.version, tuple(distribution.requires or ()))
    return found


def _canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _rclpy(host: Host) -> list[Diagnosis]:
    with tempfile.TemporaryDirectory() as home:
        environment = ros_env.environment(home=Path(home))
        ran = host.run([sys.executable, "-c", "import rclpy, std_msgs.msg; print('fine')"], 20, environment)
    if ran.output.endswith("fine"):
        return [Diagnosis("import rclpy", State.OK, "works in a clean process")]
    return [Diagnosis("import rclpy", State.BAD, _last_line(ran.output), AGAIN)]


def _launch(_host: Host) -> list[Diagnosis]:
    """A package named launch on the Python index has nothing to do with ROS, and hides what stands in for it."""
    try:
        files = importlib.metadata.files("launch") or []
    except importlib.metadata.PackageNotFoundError:
        return [Diagnosis("launch", State.OK, "no foreign package of that name")]
    if any(str(file) == "launch/launch_description.py" for file in files):
        return [Diagnosis("launch", State.OK, "the one of ROS 2")]
    found = "a package that only shares its name with ROS 2's launch is installed"
    return [Diagnosis("launch", State.BAD, found, _pip("uninstall -y launch"))]


# What the sandbox asks of bubblewrap, and no more: a wall of its own, and one inside a trial's network.
_NODE_WALL = ["bwrap", "--ro-bind", "/", "/", "--proc", "/proc", "--dev", "/dev", "--tmpfs", "/run"]
_NODE_WALL += ["--unshare-user", "--unshare-pid", "--unshare-ipc", "--die-with-parent", "--"]
_WALL = [*_NODE_WALL[:-1], "--unshare-net", "--"]


def _walls(host: Host) -> list[Diagnosis]:
    """Bubblewrap, bubblewrap inside it, and DDS inside it: each needs the one before."""
    later = ("nested bubblewrap", "DDS in a network namespace")
    if host.which("bwrap") is None:
        fix = install_line(host, ["bubblewrap"])
        return [
            Diagnosis("bubblewrap", State.BAD, "not found", fix),
            *(Diagnosis(name, State.BAD, "not tried: bubblewrap is missing", fix) for name in later),
        ]
    ran = host.run([*_WALL, "true"], 5)
    if not ran.ok:
        reason, fix = _why_no_wall(host, _last_line(ran.output))
        return [
            Diagnosis("bubblewrap", State.BAD, reason, fix),
            *(Diagnosis(name, State.BAD, "not tried: bubblewrap does not work", fix) for name in later),
        ]
    return [Diagnosis("bubblewrap", State.OK, "walls in a process, a network and its users"), _nested(host), _dds(host)]


def _why_no_wall(host: Host, said: str) -> tuple[str, str]:
    """Return the reason why bubblewrap fails here, and what mends it."""
    sudo = "" if host.root else "sudo "
    for setting, forbids, allows in (
        ("kernel.apparmor_restrict_unprivileged_userns", "1", "0"),
        ("kernel.unprivileged_userns_clone", "0", "1"),
        ("user.max_user_namespaces", "0", "15000"),
    ):
        value = host.read("/proc/sys/" + setting.replace(".", "/"))
        if value is not None and value.strip() == forbids:
            return f"{setting} is {forbids}, which forbids it ({said})", f"{sudo}sysctl -w {setting}={allows}"
    if host.exists("/.dockerenv") or host.exists("/run/.containerenv"):
        options = " ".join(f"--security-opt {option}=unconfined" for option in ("seccomp", "apparmor", "systempaths"))
        return f"this container forbids it ({said})", f"docker run {options} ...  (start the container again so)"
    return (
        f"does not work ({said})",
        f"{' '.join(_WALL)} true  (shows the reason; a container or a kernel setting forbids it)",
    )


def _nested(host: Host) -> Diagnosis:
    name = "nested bubblewrap"
    ran = host.run(namespaces.private_network([*_NODE_WALL, "true"]), 5)
    if ran.ok:
        return Diagnosis(name, State.OK, "works; a node's wall fits into its trial's network")
    reason, fix = _why_no_wall(host, _last_line(ran.output))
    return Diagnosis(name, State.BAD, reason, fix)


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
# The time for a message starts when both are ready, so that a busy machine is not taken for a deaf one.
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


def _dds(host: Host) -> Diagnosis:
    """Two nodes in a network of their own, the listener behind a wall as a student's node is."""
    name = "DDS in a network namespace"
    listener = [*_NODE_WALL[:-1], "--setenv", "ROS_LOG_DIR", "/run/ros-log", "--", sys.executable, "-c", _LISTENER]
    with tempfile.TemporaryDirectory() as home:
        ran = host.run(
            namespaces.private_network([sys.executable, "-c", _TALKER, *listener]),
            DDS_SECONDS,
            ros_env.environment(home=Path(home)),
        )
    if ran.ok:
        return Diagnosis(name, State.OK, "a message gets through a wall")
    fix = f"{' '.join(namespaces.private_network(['ip', 'address', 'show', 'lo']))}  (lo must be UP, with 127.0.0.1)"
    return Diagnosis(name, State.BAD, f"nothing got through a wall: {_last_line(ran.output)}", fix)


def _cgroups(host: Host) -> list[Diagnosis]:
    """Where memory and process counts are held: asked as a grading asks. Without, resource limits do.

    That way makes a group and takes it away; with version 2 it also moves this process into one, as a grading does.
    """
    name = "cgroups"
    hierarchy = host.cgroups()
    if hierarchy is not None:
        folders = ", ".join(sorted({str(folder) for folder in hierarchy.folders.values()}))
        return [Diagnosis(name, State.OK, f"version {hierarchy.version}, below {folders}")]
    standing_in = "resource limits stand in"
    if host.exists("/sys/fs/cgroup/cgroup.controllers"):
        fix = "systemd-run --user --scope -p Delegate=yes .venv/bin/grader grade SUBMISSION --out out/NAME"
        return [Diagnosis(name, State.WARN, f"version 2, memory and pids not delegated to us; {standing_in}", fix)]
    missing = [each for each in ("memory", "pids") if not host.exists(f"/sys/fs/cgroup/{each}")]
    if len(missing) == 2:
        return [Diagnosis(name, State.WARN, f"none; {standing_in}")]
    if missing:
        return [Diagnosis(name, State.WARN, f"version 1, without the controller {missing[0]}; {standing_in}")]
    return [Diagnosis(name, State.WARN, f"version 1, not writable for us; {standing_in}", "sudo -E make grade")]


def _room(host: Host) -> list[Diagnosis]:
    match = re.search(r"^MemAvailable:\s*(\d+) kB", host.read("/proc/meminfo") or "", re.MULTILINE)
    memory = int(match[1]) * 1024 if match else 0
    free = host.free_bytes(str(KIT))
    return [
        Diagnosis("memory", State.OK, f"{memory / GB:.1f} GB available")
        if memory >= LITTLE_MEMORY
        else Diagnosis(
            "memory",
            State.WARN,
            f"{memory / GB:.1f} GB available, 2 GB are better",
            "ps axo rss,comm --sort -rss | head",
        ),
        Diagnosis("disk", State.OK, f"{free / GB:.1f} GB free")
        if free >= LITTLE_DISK
        else Diagnosis(
            "disk",
            State.WARN if free >= NO_DISK else State.BAD,
            f"{free / GB:.1f} GB free, 2 GB are better",
            "make clean",
        ),
    ]


def _ccache(host: Host) -> list[Diagnosis]:
    path = host.which("ccache")
    if path:
        return [Diagnosis("ccache", State.OK, path)]
    return [
        Diagnosis("ccache", State.WARN, "not found; first builds take twice as long", install_line(host, ["ccache"]))
    ]


def _pip(arguments: str) -> str:
    return f".venv/bin/python -m pip {arguments}"


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1][:200] if lines else "no message"


# In the order of the report. The slow ones run beside the others.
_LOOKS: tuple[Callable[[Host], list[Diagnosis]], ...] = (
    _python,
    _compilers,
    _build_tools,
    _headers,
    _wheels,
    _rclpy,
    _launch,
    _walls,
    _cgroups,
    _room,
    _ccache,
)
