"""Make the contract's interface types, as built by the kit, importable in the notebook's kernel, and check fields."""

from __future__ import annotations

import ctypes
import importlib
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from grader import building
from grader.errors import GraderError
from grader.host import ros_env
from grader.notebook.feedback import Progress
from grader.notebook.workspace import Workspace, course, find, in_front
from grader.words import mark, say

_KINDS = ("msg", "srv", "action")
T = TypeVar("T")


def load(workspace: Workspace, far: Callable[[str], object] = lambda _far: None) -> None:
    """Make the contract's interface types importable in this process, beside the modules of the student's package.

    The dynamic linker reads LD_LIBRARY_PATH only when a process starts, so the libraries are loaded here; the variable
    is set for those that ROS looks up by name later.
    """
    package = course().package
    if not course().interfaces:
        return
    if any(f"{package}.{kind}" in sys.modules for kind in _KINDS):
        return
    install = building.build_contract(building.cache_folder(), course(), far=far).install
    folder = install / "lib"
    os.environ["LD_LIBRARY_PATH"] = in_front(os.environ.get("LD_LIBRARY_PATH", ""), folder)
    _load_libraries(sorted(folder.glob("lib*.so")))
    with _importing_from(install / ros_env.SITE_IN_PREFIX, workspace.package / package):
        for kind in _KINDS:
            if any(type_.startswith(kind) for type_ in course().interfaces):
                importlib.import_module(f"{package}.{kind}")
        from grader.trials.messages import interface

        for type_ in course().interfaces:
            interface(type_).__class__.__import_type_support__()


def provided(action: Callable[[], T]) -> T:
    """Return what `action` returns; if an import in it fails for want of the interfaces, load them and try again."""
    try:
        return action()
    except ImportError as error:
        package, kind, *_ = [*(error.name or "").split("."), ""]
        if package != course().package or kind not in _KINDS:
            raise
    with Progress() as progress:
        if not building.contract_is_built(building.cache_folder(), course()):
            progress.say(say(building.FIRST_TIME))
        load(find())
    return action()


def check_fields() -> None:
    """Let each message of this process refuse values that are not of their fields' types, when they are set.

    ROS reads 1 in a float field as 0.0, without a word. Messages read `ROS_PYTHON_CHECK_FIELDS` by os.getenv when they
    are imported; in the environment itself the nodes and commands that cells start would inherit it.
    """
    os.getenv = _getenv
    for name, module in list(sys.modules.items()):
        if MESSAGE.fullmatch(name):
            setattr(module, _CHECK, "1")


_getenv_of_python = os.getenv
MESSAGE = re.compile(r"\w+\.(msg|srv|action)\._\w+")  # a message's generated module
_CHECK = "ros_python_check_fields"


def _getenv(key: str, default: Any = None) -> Any:
    return "1" if key == _CHECK.upper() else _getenv_of_python(key, default)


def text(type_: str) -> str:
    """Return the definition of a type as a contract names it: "srv/SetSpeed" or "std_srvs/srv/SetBool"."""
    own = type_ in course().interfaces
    *package, kind, name = type_.split("/")
    file = course().interface_file(type_) if own else f"{package[0]}/{kind}/{name}.{kind}"
    return ((course().contract if own else ros_env.PREFIX / "share") / file).read_text(encoding="utf-8")


def _load_libraries(paths: list[Path]) -> None:
    """Load shared libraries that depend on each other, in any order that works."""
    left = paths
    while left:
        failed = []
        for path in left:
            try:
                ctypes.CDLL(str(path), ctypes.RTLD_GLOBAL)
            except OSError:
                failed.append(path)
        if len(failed) == len(left):
            words = mark("Cannot load the contract's interfaces: {library}. Run `grader doctor`.")
            raise GraderError(say(words, library=failed[0].name))
        left = failed


@contextmanager
def _importing_from(site: Path, own_modules: Path) -> Iterator[None]:
    """Import the package from `site` alone; afterwards its path holds both the types and `own_modules`.

    A correct `extend_path` in the package's `__init__.py` does the same. The package must stay in sys.modules: rosidl's
    C code looks it up for each message, and ends the process if it is missing.
    """
    hidden = {name: sys.modules.pop(name) for name in list(sys.modules) if name.partition(".")[0] == course().package}
    hidden.pop(course().package, None)
    sys.path.insert(0, str(site))
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path.remove(str(site))
        sys.modules.update(hidden)
        sys.modules[course().package].__path__.insert(0, str(own_modules))
        importlib.invalidate_caches()
