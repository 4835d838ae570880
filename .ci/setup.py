"""Make the virtual environment .venv ready; called by .ci/setup, which `make` calls. Standard library only.

Done once: a stamp in .venv holds what it was made from, and while that is unchanged nothing happens or is said.
"""

import fcntl
import hashlib
import os
import platform
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
SUITS = (3, 11) <= sys.version_info[:2] <= (3, 14) and sys.implementation.name == "cpython"

sys.path.insert(0, str(ROOT))  # `python -I` leaves it out

from grader.host.machine import Host, install_commands, install_line  # noqa: E402 (found on the path set above)


class Stop(Exception):
    """Set-up cannot go on; the message says what to do."""


def main() -> int:
    """Set up what is missing; return the exit status."""
    if "--suits" in sys.argv:
        return 0 if SUITS else 1
    host = Host()
    try:
        if not ready():
            LOCK.parent.mkdir(exist_ok=True)
            with LOCK.open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)  # two `make` at once: the second waits, and then finds it done
                if not ready():
                    set_up(host)
        if host.which("bwrap") is None:
            provide(host, ["bubblewrap"], "Grading walls submissions in with bubblewrap, which is missing.")
    except Stop as stop:
        print(f"setup: {stop}", file=sys.stderr)
        return 1
    return 0


def fingerprint() -> str:
    """Return what the environment is made from: the lock, the packaging, and the place (scripts name it)."""
    packaging = tomllib.loads((ROOT / "pyproject.toml").read_text())
    packaging.pop("tool", None)  # the settings of linters change more often, and nothing here hangs on them
    parts = [(ROOT / "requirements.txt").read_text(), repr(packaging), str(ROOT)]
    return hashlib.sha256("\0".join(parts).encode(errors="surrogateescape")).hexdigest()


def ready() -> bool:
    """Say whether .venv is as it should be."""
    return STAMP.is_file() and STAMP.read_text() == fingerprint() and (VENV / "bin" / "python").exists()


def set_up(host: Host) -> None:
    """Check the tools, make the environment, install what is pinned."""
    started = time.monotonic()
    fresh = not STAMP.exists()
    say("Setting up, once; this takes about two minutes." if fresh else "Bringing .venv up to date.")
    check_machine(host)
    make_environment(host)
    install_pinned()
    pip("the course kit itself", "install", "--no-deps", "--no-build-isolation", "--editable", ".")
    wanted = [tool for tool, program in (("bubblewrap", "bwrap"), ("ccache", "ccache")) if host.which(program) is None]
    if wanted and permitted(host):
        provide(host, wanted, "")
    STAMP.write_text(fingerprint())
    say(f"Set up in {time.monotonic() - started:.0f} s.")


def check_machine(host: Host) -> None:
    """Stop where the wheels cannot work, and where a build could not."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        raise Stop(f"ROS 2 comes as wheels for Linux on x86-64; this is {platform.system()} on {platform.machine()}.")
    if platform.libc_ver()[0] != "glibc":
        raise Stop("ROS 2 comes as wheels for glibc, which this Linux does not use. Use Debian, Ubuntu or Fedora.")
    if not any(map(host.which, ("cc", "gcc", "clang"))) or not any(map(host.which, ("c++", "g++", "clang++"))):
        raise Stop(f"No C and C++ compiler was found. Type: {install_line(host, ['compiler'])}")


def make_environment(host: Host) -> None:
    """Make .venv, anew if it is from another place or its interpreter is gone."""
    need_headers(host)
    if sys.prefix != sys.base_prefix and made_here():
        return
    # Within a .venv that was moved, the interpreter below it makes the new one.
    python = getattr(sys, "_base_executable", sys.executable)
    if subprocess.run([python, "-I", "-c", "import ensurepip, venv"], capture_output=True, check=False).returncode:
        provide(host, ["venv"], f"{VERSION} cannot make virtual environments.", required=True)
    say(f"Python {platform.python_version()}: environment in .venv")
    made = host.run([python, "-I", "-m", "venv", "--clear", str(VENV)], 300)
    if not made.ok:
        raise Stop(f"The virtual environment could not be made: {last_line(made.output)}")


def made_here() -> bool:
    """Say whether the scripts in .venv, which name their place, name this one."""
    try:
        return f"{VENV}/".encode() in (VENV / "bin" / "pip").read_bytes()
    except OSError:
        return False


def need_headers(host: Host) -> None:
    """See that Python.h is there: the type support of the interfaces is compiled against it."""
    if not Path(sysconfig.get_path("include"), "Python.h").exists():
        provide(host, ["headers"], f"The C headers of {VERSION} are missing.", required=True)


def install_pinned() -> None:
    """Install requirements.txt, telling how far it is."""
    total = sum(1 for line in (ROOT / "requirements.txt").read_text().splitlines() if "==" in line)
    pip(f"{total} pinned packages", "install", "-r", "requirements.txt", total=total)


def pip(what: str, *arguments: str, total: int = 0) -> None:
    """Run pip in the environment; its words go to the log, every tenth part of the way to the console."""
    say(f"Installing {what}")
    command = [str(VENV / "bin" / "python"), "-I", "-m", "pip", "--disable-pip-version-check", "--no-input"]
    # A user's own settings of where to install would lead past the environment; those of where to fetch from stay.
    env = {k: v for k, v in os.environ.items() if k not in ("PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "PIP_USER")}
    env["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    done, shown, last = 0, 0, ""
    with LOG.open("a") as log:
        running = subprocess.Popen(
            [*command, *arguments, "--progress-bar", "off"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            text=True,
            errors="replace",
            cwd=ROOT,
            env=env,
        )
        assert running.stdout is not None
        for line in running.stdout:
            log.write(line)
            done += line.startswith(("Collecting ", "Requirement already satisfied"))
            if total and done * 5 // total > shown:
                shown = done * 5 // total
                say(f"  {min(done, total)} of {total} fetched")
            if line.startswith("Installing collected"):
                say("  putting them in place")
            last = line.strip() if line.startswith("ERROR") else last
    if running.wait():
        raise Stop(f"pip could not install {what}: {last or 'no reason given'} (all it said: {LOG.relative_to(ROOT)})")


def permitted(host: Host) -> bool:
    """Say whether we may install packages of the system without being asked for a password."""
    return host.root or (host.which("sudo") is not None and host.run(["sudo", "-n", "true"], 10).ok)


def provide(host: Host, things: list[str], why: str, *, required: bool = False) -> None:
    """Install `things` by the system's package manager where that is permitted; otherwise say what to type."""
    commands = install_commands(host, things, VERSION)
    typed = f"{why} Type: {install_line(host, things, VERSION)}".strip()
    if commands and permitted(host):
        say(f"Installing {', '.join(things)} with {commands[0][0]}")
        sudo = [] if host.root else ["sudo", "-n", "--preserve-env=DEBIAN_FRONTEND"]
        os.environ["DEBIAN_FRONTEND"] = "noninteractive"
        # A list of packages that cannot be refreshed may still be good enough, so only the last command counts.
        for command in commands:
            ran = host.run([*sudo, *command], 600)
        if ran.ok:
            return
        typed += f"  (it was tried: {last_line(ran.output)})"
    if required:
        raise Stop(typed)
    if why:
        print(f"setup: {typed}", file=sys.stderr)


def say(text: str) -> None:
    """Tell how far set-up is; results of `make` go to stdout, this does not."""
    print(f"setup: {text}", file=sys.stderr, flush=True)


def last_line(text: str) -> str:
    """Return the last line with something in it."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "no reason given"


if __name__ == "__main__":
    if shutil.which("true") is None:
        os.environ["PATH"] = os.environ.get("PATH", "") + ":/usr/bin:/bin"
    sys.exit(main())
