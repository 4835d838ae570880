"""Where the student's package lies, and the environment in which shell cells find ROS 2, the kit and what was built."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from collections.abc import MutableMapping
from dataclasses import dataclass
from pathlib import Path

from grader import build
from grader.contract import spec
from grader.errors import GraderError
from grader.host import ros_env

PACKAGE = spec.PACKAGE
VARIABLE = "ROS2_COURSE_WS"
NOTEBOOK = "ROS2_COURSE_NOTEBOOK"
"""Where `begin` notes the notebook at work ("05")."""


@dataclass(frozen=True)
class Workspace:
    """A colcon workspace: `root` with src/, and build/, install/ and log/ once something has been built."""

    root: Path

    @property
    def package(self) -> Path:
        """Return the folder of the student's package."""
        return self.root / "src" / PACKAGE

    @property
    def install(self) -> Path:
        """Return the install tree of the package, as a plain `colcon build` makes it."""
        return self.root / "install" / PACKAGE

    @property
    def domain_id(self) -> int:
        """Return the DDS domain of this workspace, 1 to 100: two students on one machine must not hear each other."""
        digest = hashlib.sha256(os.fsencode(self.root)).digest()
        return 1 + int.from_bytes(digest[:4], "big") % 100

    def shown(self, path: Path) -> str:
        """Return a path in the workspace as a student should read it, the same on every machine."""
        with contextlib.suppress(ValueError):
            return str(Path("ws") / path.relative_to(self.root))
        return path.name


def find(here: Path | None = None) -> Workspace:
    """Return the workspace: $ROS2_COURSE_WS, or `ws` beside the notebooks, looked for from `here` upwards.

    Raises:
        GraderError: there is no folder `notebooks` above, and the variable is not set.
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
        f"There is no folder `notebooks` at or above the present one. Open a notebook in it, or set {VARIABLE}."
    )


def open_workspace(notebook: str) -> Workspace:
    """Make the workspace where it is missing, change into the package's folder, and prepare the environment."""
    found = find()
    os.environ[NOTEBOOK] = notebook
    found.package.mkdir(parents=True, exist_ok=True)
    os.chdir(found.package)
    _write_colcon_defaults(found)
    prepare(found, os.environ)
    return found


def prepare(workspace: Workspace, environment: MutableMapping[str, str]) -> None:
    """Set what `source install/setup.bash` would set, and what the wheels need besides. Can be done again any time.

    The workspace counts as soon as it has been built.
    """
    overlays = [workspace.install] if (workspace.install / "share").is_dir() else []
    wanted = ros_env.environment(*overlays, home=Path.home())
    wanted |= {
        "PATH": _in_front(environment.get("PATH", ""), ros_env.PREFIX / "bin"),
        "PYTHONPATH": _in_front(environment.get("PYTHONPATH", ""), *(o / ros_env.SITE_IN_PREFIX for o in overlays)),
        "ROS_DOMAIN_ID": str(workspace.domain_id),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": discovery_range(),
        "ROS_LOG_DIR": str(workspace.root / "log" / "ros"),
        # A plain `colcon build` then does what docs/ros-from-wheels.md describes.
        "COLCON_DEFAULTS_FILE": str(_defaults_file(workspace)),
        "COLCON_LOG_LEVEL": "error",  # it would warn of the wheels' prefix, which has no setup files
        "CMAKE_GENERATOR": "Ninja",
    }
    if shutil.which("ccache"):
        wanted |= {
            "CMAKE_C_COMPILER_LAUNCHER": "ccache",
            "CMAKE_CXX_COMPILER_LAUNCHER": "ccache",
            "CCACHE_DIR": str(build.cache_folder() / "ccache"),
            "CCACHE_READONLY": "1",  # only the kit's own builds fill it
            "CCACHE_TEMPDIR": "/tmp",
            "CCACHE_NOHASHDIR": "1",
            "CCACHE_BASEDIR": str(workspace.root),
            "CCACHE_NOSTATS": "1",
        }
    for name in ("HOME", "LANG"):
        wanted.pop(name, None)
    for name, value in wanted.items():
        if environment.get(name) != value:
            environment[name] = value


def discovery_range(interfaces: Path = Path("/sys/class/net")) -> str:
    """Return how far DDS looks for others: on this machine only, or a class would drive one another's robots.

    Where there is nothing but the loopback, LOCALHOST finds nobody (it wants multicast there), and SUBNET reaches
    no one else either.
    """
    states = {path.parent.name: path.read_text().strip() for path in interfaces.glob("*/operstate")}
    return "LOCALHOST" if any(state == "up" for name, state in states.items() if name != "lo") else "SUBNET"


def ignored_by_colcon(folder: Path) -> None:
    """Make the folder if it is missing, and keep colcon from looking for packages in it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "COLCON_IGNORE").touch()


def _in_front(path: str, *folders: Path) -> str:
    """Return a search path with `folders` in front, each once."""
    first = [str(folder) for folder in folders]
    return os.pathsep.join([*first, *(part for part in path.split(os.pathsep) if part and part not in first)])


def _defaults_file(workspace: Workspace) -> Path:
    return workspace.root / ".colcon" / "defaults.yaml"


def _write_colcon_defaults(workspace: Workspace) -> None:
    path = _defaults_file(workspace)
    handlers = '["status-", "terminal_title-"]'
    text = f'build:\n  event-handlers: {handlers}\n  cmake-args: ["-DCMAKE_PROJECT_INCLUDE={ros_env.CMAKE_HOOK}"]\n'
    if not path.is_file() or path.read_text() != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
