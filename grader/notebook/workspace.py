"""Locate the student's package, and set up the environment in which shell cells find ROS 2, the kit and the build."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shlex
import shutil
import socket
from collections.abc import MutableMapping
from dataclasses import dataclass
from pathlib import Path

from grader import KIT, building
from grader.course import Course
from grader.course import find as find_course
from grader.course.reader import VARIABLE as COURSE
from grader.errors import GraderError
from grader.host import dds_domain, ros_env
from grader.host.tempdir import write_atomically
from grader.words import say

VARIABLE = "ROS2_COURSE_WS"
NOTEBOOK = "ROS2_COURSE_NOTEBOOK"
"""The environment variable in which `begin` notes the current notebook ("05")."""
FRESH = "ROS2_COURSE_FRESH"
"""If set, checks run everything anew, so that a stored notebook says the same whatever was run before."""


def course() -> Course:
    """Return the course that this kernel is for."""
    return find_course()


LINKED = ".linked"
DOMAINS = dds_domain.LOW
_DOMAIN = ".ros_domain"
_DEFAULTS = Path(".colcon", "defaults.yaml")
_claims: dict[Path, socket.socket] = {}


@dataclass(frozen=True)
class Workspace:
    """A colcon workspace: `root` holds src/, and after a build also build/, install/ and log/."""

    root: Path

    @property
    def package(self) -> Path:
        """Return the folder of the student's package."""
        return self.root / "src" / course().package

    @property
    def install(self) -> Path:
        """Return the package's install tree, where a plain `colcon build` puts it."""
        return self.root / "install" / course().package

    @property
    def is_linked(self) -> bool:
        """Return whether its install tree has links to the sources, so that changed Python needs no build."""
        return (self.root / LINKED).is_file()

    @property
    def domain_id(self) -> int:
        """Return the DDS domain of this workspace, 1 to 100: the one that was claimed last, else one by its path."""
        with contextlib.suppress(OSError, ValueError):
            if (number := int((self.root / _DOMAIN).read_text())) in DOMAINS:
                return number
        digest = hashlib.sha256(os.fsencode(self.root)).digest()
        return DOMAINS[int.from_bytes(digest[:4], "big") % len(DOMAINS)]

    @property
    def variables(self) -> dict[str, str]:
        """Return what ROS 2 is told in a workspace: its DDS domain, who may hear it, and where its logs go."""
        return ros_env.ON_THIS_MACHINE | {
            "ROS_DOMAIN_ID": str(self.domain_id),
            "ROS_LOG_DIR": str(self.root / "log" / "ros"),
        }

    def shown(self, path: Path) -> str:
        """Return a path in the workspace as it is shown to students, the same on every machine."""
        with contextlib.suppress(ValueError):
            return str(Path("ws") / path.relative_to(self.root))
        return path.name


def find(here: Path | None = None) -> Workspace:
    """Return the workspace: $ROS2_COURSE_WS, or `ws` beside the folder `notebooks`, searched from `here` upwards.

    Raises:
        GraderError: the variable is not set, and no folder `notebooks` was found.
    """
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return Workspace(Path(chosen).expanduser().resolve())
    here = (here or Path.cwd()).resolve()
    for folder in (here, *here.parents):
        if folder.name == "notebooks" or (folder / "notebooks").is_dir():
            root = folder.parent if folder.name == "notebooks" else folder
            return Workspace(root / "ws")
    raise GraderError(
        say(
            "There is no folder `notebooks` in or above the current one. Open a notebook in it, or set {variable}.",
            variable=VARIABLE,
        )
    )


def open_workspace(notebook: str) -> Workspace:
    """Create the workspace if it is missing, change into the package's folder, and prepare the environment."""
    found = find()
    os.environ[NOTEBOOK] = notebook
    if os.environ.get(COURSE):
        os.environ[COURSE] = str(course().folder)  # it may have been named as seen from the folder that is left here
    found.package.mkdir(parents=True, exist_ok=True)
    os.chdir(found.package)
    # The status line says how far a build is; notebooks and terminals draw it anew in place.
    handlers = '["status+", "terminal_title-"]'
    text = f'build:\n  event-handlers: {handlers}\n  cmake-args: ["-DCMAKE_PROJECT_INCLUDE={ros_env.CMAKE_HOOK}"]\n'
    (found.root / _DEFAULTS).parent.mkdir(exist_ok=True)
    (found.root / _DEFAULTS).write_text(text)
    claim_domain(found)
    prepare(found, os.environ)
    return found


def claim_domain(workspace: Workspace) -> int:
    """Claim a DDS domain for a workspace until this process ends, and return it.

    It stays the same for as long as no other workspace has claimed it meanwhile. Several processes may work in one
    workspace: they share its domain.

    Raises:
        GraderError: other workspaces use all domains.
    """
    root, first = workspace.root, workspace.domain_id
    if root in _claims:
        return first
    # What tells it from others on this machine, even if containers give them the same path.
    status = root.stat()
    identity = f"{root}\0{status.st_dev}\0{status.st_ino}\0{status.st_uid}"
    for number in [first, *(number for number in DOMAINS if number != first)]:
        if held := dds_domain.claim(number, hashlib.sha256(identity.encode()).hexdigest()[:16]):
            _claims[root] = held
            write_atomically(root / _DOMAIN, f"{number}\n")
            return number
    raise GraderError(
        say(
            "All {n} ROS domains of this machine are in use, so two robots would share one. "
            "Shut down the kernels of notebooks that are not in use, then run this cell again.",
            n=len(DOMAINS),
        )
    )


def prepare(workspace: Workspace, environment: MutableMapping[str, str]) -> None:
    """Set the variables that `source install/setup.bash` would set, and those that the wheels need.

    Can be called again at any time; includes the workspace's install tree once there is one.
    """
    overlays = [workspace.install] if (workspace.install / "share").is_dir() else []
    wanted = ros_env.environment(*overlays, home=Path.home())
    wanted |= workspace.variables | {
        "PATH": in_front(environment.get("PATH", ""), ros_env.PREFIX / "bin"),
        "PYTHONPATH": in_front(environment.get("PYTHONPATH", ""), *(o / ros_env.SITE_IN_PREFIX for o in overlays)),
        # A plain `colcon build` then uses the settings that docs/ros-from-wheels.md describes.
        "COLCON_DEFAULTS_FILE": str(workspace.root / _DEFAULTS),
        "COLCON_LOG_LEVEL": "error",  # it would warn that the wheels' prefix has no setup files
        "CMAKE_GENERATOR": "Ninja",
    }
    if shutil.which("ccache"):
        wanted |= {
            "CMAKE_C_COMPILER_LAUNCHER": "ccache",
            "CMAKE_CXX_COMPILER_LAUNCHER": "ccache",
            "CCACHE_DIR": str(building.cache_folder() / "ccache"),
            "CCACHE_READONLY": "1",  # only the kit's own builds write to it
            "CCACHE_TEMPDIR": "/tmp",
            "CCACHE_NOHASHDIR": "1",
            "CCACHE_BASEDIR": str(workspace.root),
            "CCACHE_NOSTATS": "1",
        }
    environment.update({name: value for name, value in wanted.items() if name not in ("HOME", "LANG")})


def shell_lines(shell: str, workspace: Workspace | None = None) -> str:
    """Return what grader/ros2/setup.bash runs in a terminal ("bash", "zsh") to join it to the notebooks' workspace.

    It sets their DDS domain, and the package as it was built last.
    """
    workspace = workspace or find(KIT)
    variables = {"ROS_DOMAIN_ID": str(workspace.domain_id)} | ros_env.ON_THIS_MACHINE
    lines = [f"export {name}={shlex.quote(value)}" for name, value in variables.items()]
    # Not setup.bash: that one also sources the prefix of the wheels, which has no setup files.
    setup = workspace.root / "install" / f"local_setup.{shell}"
    return "\n".join([*lines, f". {shlex.quote(str(setup))}"] if setup.is_file() else lines)


def ignored_by_colcon(folder: Path) -> None:
    """Create the folder if it is missing, and keep colcon from searching it for packages."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "COLCON_IGNORE").touch()


def in_front(path: str, *folders: Path) -> str:
    """Return a search path with `folders` moved to the front, each once."""
    first = [str(folder) for folder in folders]
    return os.pathsep.join([*first, *(part for part in path.split(os.pathsep) if part and part not in first)])
