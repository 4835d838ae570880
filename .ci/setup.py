"""Prepare the virtual environment .venv. Called by .ci/setup, which `make` calls. Standard library only.

A stamp in .venv records what the environment was made from. While that is unchanged, set-up does and prints nothing.
"""

import ast
import errno
import fcntl
import hashlib
import json
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
PIP = [str(VENV / "bin" / "python"), "-I", "-m", "pip", "--disable-pip-version-check", "--no-input"]
UV = [str(VENV / "bin" / "uv"), "pip", "install", "--python", str(VENV / "bin" / "python")]
UV_NAMES = {
    "index-url": "UV_DEFAULT_INDEX", "extra-index-url": "UV_INDEX", "find-links": "UV_FIND_LINKS",
    "trusted-host": "UV_INSECURE_HOST", "no-index": "UV_NO_INDEX", "cert": "SSL_CERT_FILE", "proxy": "ALL_PROXY",
}  # fmt: skip
PIP_SECTIONS = ("global", "install", ":env:")  # each wins over those before it
OLDEST_GLIBC = (2, 28)  # of the wheels' tag, manylinux_2_28
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
    except OSError as error:
        if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise
        print(f"setup: {forbidden(error)}", file=sys.stderr)
        return 1
    return 0


def forbidden(error: OSError) -> str:
    """Return in a sentence why this user may not set up here, and what to do."""
    path = Path(error.filename or ROOT)
    if path.is_relative_to(VENV / "bin"):
        return (
            f"The Python of .venv, {path.resolve()}, is out of your reach: it belongs to the user who set this kit "
            f"up. Copy the kit without .venv into a folder of your own and run `make setup` there."
        )
    return f"You may not write to {path}. Copy the kit into a folder of your own and run `make setup` there."


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
    say("Setting up for the first time; this takes one to three minutes." if fresh else "Updating .venv.")
    check_machine(machine)
    make_environment(machine)
    install_pinned()
    say("Installing the course kit itself")
    pip("the course kit itself", "install", "--no-deps", "--no-build-isolation", "--editable", ".")
    wanted = [tool for tool, program in (("bubblewrap", "bwrap"), ("ccache", "ccache")) if not machine.which(program)]
    if wanted and permitted(machine):
        provide(machine, wanted, "")
    adjust_jupyter()
    STAMP.write_text(fingerprint())
    say(f"Done in {time.monotonic() - started:.0f} s.")
    grade = ", or `make grade` to grade the reference package" if (ROOT / "solution_pkg").is_dir() else ""
    say(f"Next, type `make jupyter` to open the course{grade}.")


def adjust_jupyter() -> None:
    """Keep JupyterLab from asking whether it may fetch news, let it save what widgets show, and show pages as pages.

    A live view whose kernel is gone can then say so after a reload of the page; else it is "model not found". A link to
    a page in Markdown, as to the glossary, would open its source in an editor. The kernel's first completion in a file
    that imports rclpy takes seconds on a busy machine, and JupyterLab would have given up after one.
    """
    settings = VENV / "share" / "jupyter" / "lab" / "settings" / "overrides.json"
    settings.parent.mkdir(parents=True, exist_ok=True)
    quiet = {"fetchNews": "false", "checkForUpdates": False}
    wanted = {
        "@jupyterlab/apputils-extension:notification": quiet,
        "@jupyter-widgets/jupyterlab-manager:plugin": {"saveState": True},
        "@jupyterlab/docmanager-extension:plugin": {"defaultViewers": {"markdown": "Markdown Preview"}},
        "@jupyterlab/completer-extension:manager": {"providerTimeout": 5000},
    }
    settings.write_text(json.dumps(wanted))


def check_machine(machine: Machine) -> None:
    """Stop where the wheels cannot work, and where nothing can be compiled."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        raise Stop(
            f"The ROS 2 wheels are for Linux on x86-64; this is {platform.system()} on {platform.machine()}, for which "
            f"there are none. Use WSL 2 (on Windows), your course's JupyterHub, or an x86-64 machine with Linux."
        )
    libc, version = platform.libc_ver()
    if libc != "glibc":
        raise Stop("The ROS 2 wheels need glibc, which this Linux does not use. Use Debian, Ubuntu or Fedora.")
    if tuple(map(int, version.split(".")[:2])) < OLDEST_GLIBC:
        raise Stop(f"The ROS 2 wheels need glibc 2.28; this Linux has {version}. Use Debian 10, Ubuntu 20.04 or newer.")
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
    """Install requirements.txt with uv, which takes a third of pip's time; with pip where uv cannot be had."""
    pins = re.findall(r"^[\w.-]+==[^ ;]+", (ROOT / "requirements.txt").read_text(), re.MULTILINE)
    (uv,) = (pin for pin in pins if pin.startswith("uv=="))
    say(f"Installing {len(pins)} pinned packages")
    # Compiled here: a sandbox cannot write byte code, and without it every node would compile what it imports.
    # pip, too, takes the best match of all indexes; uv by itself takes the first index that knows the name.
    pinned = ["--no-deps", "-r", "requirements.txt"]  # all there is: what `make lock` has left out is not wanted
    with_uv = ["--compile-bytecode", "--index-strategy", "unsafe-best-match", *pinned]
    if logged([*PIP, "install", uv]) or logged([*UV, *with_uv], **index_settings()):
        say("  uv could not; pip takes its place, which takes a minute longer")
        pip("the pinned packages", "install", *pinned)
    if (lock := VENV / ".lock").exists():  # uv's, which anyone may write
        lock.chmod(0o644)


def index_settings() -> dict[str, str]:
    """Return where pip is set to fetch from, as the variables that uv reads instead of pip's settings."""
    listed = subprocess.run([*PIP, "config", "list"], env=environment(), capture_output=True, text=True, check=False)
    found: dict[str, str] = {}
    # Each line is SECTION.OPTION='VALUE'; pip 23 lists the environment (":env:") first, pip 26 last.
    lines = [line.partition("=")[::2] for line in listed.stdout.splitlines()]
    for section, (option, value) in ((wins, line) for wins in PIP_SECTIONS for line in lines):
        place, _, key = option.rpartition(".")
        name = UV_NAMES.get(key)
        if name and place == section:
            found[name] = ("," if name == "UV_FIND_LINKS" else " ").join(ast.literal_eval(value).split())
    return found


def pip(what: str, *arguments: str) -> None:
    """Run pip in the environment, or stop."""
    if last := logged([*PIP, *arguments, "--progress-bar", "off"]):
        raise Stop(f"pip could not install {what}: {last} (full log: {LOG.relative_to(ROOT)})")


def logged(command: list[str], **more: str) -> str:
    """Run a command, its output to the log, uv's steps to the console; return why it failed, "" if it did not."""
    why = "no reason given"
    with LOG.open("a") as log:
        running = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, errors="replace", cwd=ROOT, env=more | environment(),
        )  # fmt: skip
        assert running.stdout is not None
        for line in running.stdout:
            log.write(line)
            if line.startswith(("Resolved ", "Prepared ", "Installed ", "Bytecode compiled ")):
                say(f"  {line.strip()}")
            if line.strip() and not why.startswith("ERROR"):  # pip's, which advice may follow
                why = line.strip()
    return why if running.wait() else ""


def environment() -> dict[str, str]:
    """Return the environment for pip and uv."""
    # A user's settings for where to install would lead out of the environment; those for where to fetch from stay.
    kept = {k: v for k, v in os.environ.items() if k not in ("PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "PIP_USER")}
    return kept | {"_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}


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
