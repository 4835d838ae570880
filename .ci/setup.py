"""Prepare the virtual environment .venv. Called by .ci/setup, which `make` calls. Standard library only.

A stamp in .venv records what the environment was made from. While that is unchanged, set-up does and prints nothing.
"""

import fcntl
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
STAMP = VENV / "ready"
LOG = ROOT / ".kit" / "setup.log"
LOCK = ROOT / ".kit" / "setup.lock"
VERSION = f"python{sys.version_info[0]}.{sys.version_info[1]}"
SUPPORTED = (3, 11) <= sys.version_info[:2] <= (3, 14) and sys.implementation.name == "cpython"

sys.path.insert(0, str(ROOT))  # `python -I` leaves it out

from grader.host.machine import Machine, install_commands, install_line  # noqa: E402 (found on the path set above)


class Stop(Exception):
    """Set-up cannot continue; the message says what to do."""


def main() -> int:
    """Set up what is missing; return the exit status."""
    if "--supported" in sys.argv:
        return 0 if SUPPORTED else 1
    machine = Machine()
    try:
        if not ready():
            LOCK.parent.mkdir(exist_ok=True)
            with LOCK.open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)  # of two `make` at once, the second waits and then finds it done
                if not ready():
                    set_up(machine)
        if machine.which("bwrap") is None:
            provide(machine, ["bubblewrap"], "Grading runs submissions in bubblewrap, which is missing.")
    except Stop as stop:
        print(f"setup: {stop}", file=sys.stderr)
        return 1
    return 0


def fingerprint() -> str:
    """Return a hash of what the environment is made from: the lock, the packaging, and the path (scripts name it)."""
    packaging = tomllib.loads((ROOT / "pyproject.toml").read_text())
    packaging.pop("tool", None)  # the linters' settings change more often, and the environment does not depend on them
    parts = [(ROOT / "requirements.txt").read_text(), repr(packaging), str(ROOT)]
    return hashlib.sha256("\0".join(parts).encode(errors="surrogateescape")).hexdigest()


def ready() -> bool:
    """Return whether .venv is up to date."""
    return STAMP.is_file() and STAMP.read_text() == fingerprint() and (VENV / "bin" / "python").exists()


def set_up(machine: Machine) -> None:
    """Check the tools, make the environment and install the pinned packages."""
    started = time.monotonic()
    fresh = not STAMP.exists()
    say("Setting up for the first time; this takes about two minutes." if fresh else "Updating .venv.")
    check_machine(machine)
    make_environment(machine)
    install_pinned()
    pip("the course kit itself", "install", "--no-deps", "--no-build-isolation", "--editable", ".")
    wanted = [tool for tool, program in (("bubblewrap", "bwrap"), ("ccache", "ccache")) if not machine.which(program)]
    if wanted and permitted(machine):
        provide(machine, wanted, "")
    STAMP.write_text(fingerprint())
    say(f"Done in {time.monotonic() - started:.0f} s.")


def check_machine(machine: Machine) -> None:
    """Stop where the wheels cannot work, and where nothing can be compiled."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        raise Stop(f"The ROS 2 wheels are for Linux on x86-64; this is {platform.system()} on {platform.machine()}.")
    if platform.libc_ver()[0] != "glibc":
        raise Stop("The ROS 2 wheels need glibc, which this Linux does not use. Use Debian, Ubuntu or Fedora.")
    if not any(map(machine.which, ("cc", "gcc", "clang"))) or not any(map(machine.which, ("c++", "g++", "clang++"))):
        raise Stop(f"No C and C++ compiler was found. Run: {install_line(machine, ['compiler'])}")


def make_environment(machine: Machine) -> None:
    """Make .venv; make it again if it was moved or its interpreter is gone."""
    need_headers(machine)
    if sys.prefix != sys.base_prefix and made_here():
        return
    # In a .venv that was moved, the interpreter below it makes the new one.
    python = getattr(sys, "_base_executable", sys.executable)
    if subprocess.run([python, "-I", "-c", "import ensurepip, venv"], capture_output=True, check=False).returncode:
        provide(machine, ["venv"], f"{VERSION} cannot make virtual environments.", required=True)
    say(f"Making a virtual environment in .venv with Python {platform.python_version()}")
    made = machine.run([python, "-I", "-m", "venv", "--clear", str(VENV)], 300)
    if not made.ok:
        raise Stop(f"The virtual environment could not be made: {last_line(made.output)}")


def made_here() -> bool:
    """Return whether the scripts in .venv, which contain its path, name this one."""
    try:
        return f"{VENV}/".encode() in (VENV / "bin" / "pip").read_bytes()
    except OSError:
        return False


def need_headers(machine: Machine) -> None:
    """Provide Python.h if it is missing: the type support of the interfaces is compiled against it."""
    if not Path(sysconfig.get_path("include"), "Python.h").exists():
        provide(machine, ["headers"], f"The C headers of {VERSION} are missing.", required=True)


def install_pinned() -> None:
    """Install requirements.txt and report the progress."""
    total = len(re.findall(r"^[\w.-]+==", (ROOT / "requirements.txt").read_text(), re.MULTILINE))
    pip(f"{total} pinned packages", "install", "-r", "requirements.txt", total=total)


def pip(what: str, *arguments: str, total: int = 0) -> None:
    """Run pip in the environment. Its output goes to the log; the console shows each fifth of the way."""
    say(f"Installing {what}")
    command = [str(VENV / "bin" / "python"), "-I", "-m", "pip", "--disable-pip-version-check", "--no-input"]
    # A user's settings for where to install would lead out of the environment; those for where to fetch from stay.
    env = {k: v for k, v in os.environ.items() if k not in ("PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "PIP_USER")}
    env["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    done, shown, last = 0, 0, ""
    with LOG.open("a") as log:
        running = subprocess.Popen(
            [*command, *arguments, "--progress-bar", "off"],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
            text=True, errors="replace", cwd=ROOT, env=env,
        )  # fmt: skip
        assert running.stdout is not None
        for line in running.stdout:
            log.write(line)
            done += line.startswith(("Collecting ", "Requirement already satisfied"))
            if total and done * 5 // total > shown:
                shown = done * 5 // total
                say(f"  {min(done, total)} of {total} fetched")
            if line.startswith("Installing collected"):
                say("  copying the files")
            last = line.strip() if line.startswith("ERROR") else last
    if running.wait():
        raise Stop(f"pip could not install {what}: {last or 'no reason given'} (full log: {LOG.relative_to(ROOT)})")


def permitted(machine: Machine) -> bool:
    """Return whether we may install system packages without typing a password."""
    return machine.root or (machine.which("sudo") is not None and machine.run(["sudo", "-n", "true"], 10).ok)


def provide(machine: Machine, things: list[str], why: str, *, required: bool = False) -> None:
    """Install `things` with the system's package manager where that is permitted; otherwise print the command.

    Raises:
        Stop: they are `required` and could not be installed.
    """
    commands = install_commands(machine, things, VERSION)
    advice = f"{why} Run: {install_line(machine, things, VERSION)}".strip()
    if commands and permitted(machine):
        say(f"Installing {', '.join(things)} with {commands[0][0]}")
        sudo = [] if machine.root else ["sudo", "-n", "--preserve-env=DEBIAN_FRONTEND"]
        os.environ["DEBIAN_FRONTEND"] = "noninteractive"
        # A package list that cannot be refreshed may still be good enough, so only the last command counts.
        for command in commands:
            result = machine.run([*sudo, *command], 600)
        if result.ok:
            return
        advice += f"  (tried, but: {last_line(result.output)})"
    if required:
        raise Stop(advice)
    if why:
        print(f"setup: {advice}", file=sys.stderr)


def say(text: str) -> None:
    """Report progress on stderr; stdout is for the results of `make`."""
    print(f"setup: {text}", file=sys.stderr, flush=True)


def last_line(text: str) -> str:
    """Return the last line that is not blank."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "no reason given"


if __name__ == "__main__":
    if shutil.which("true") is None:
        os.environ["PATH"] = os.environ.get("PATH", "") + ":/usr/bin:/bin"
    sys.exit(main())
