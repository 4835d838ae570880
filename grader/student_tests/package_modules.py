"""The package's own Python modules: their texts, and where they are in the sandbox that runs the tests."""

from __future__ import annotations

from pathlib import Path

from grader import build
from grader.contract import spec
from grader.host import ros_env
from grader.sandbox import untrusted

PACKAGE = Path("/ws/package")
"""The source folder, inside the sandbox."""
MODULES = build.INSTALL / ros_env.SITE_IN_PREFIX / spec.PACKAGE
"""The installed modules, inside the sandbox."""
_GENERATED = ("msg", "srv", "action")


def texts(package: Path, install: Path) -> dict[str, str | None]:
    """Return the text of each of the package's Python modules by its path relative to the package.

    Installed modules count; if none are installed, those of the source folder. Generated modules are left out.
    The text is None where `untrusted.read_python` cannot read it.
    """
    for root in (install / ros_env.SITE_IN_PREFIX / spec.PACKAGE, package / spec.PACKAGE):
        found: dict[str, str | None] = {}
        for path in sorted(root.rglob("*.py")):
            inside = path.relative_to(root)
            if inside.parts[0] in _GENERATED or path.is_symlink() or not path.is_file():
                continue
            found[str(Path(spec.PACKAGE) / inside)] = untrusted.read_python(path)
        if found:
            return found
    return {}


def sandbox_paths(package: Path, install: Path, name: str, text: str) -> list[str]:
    """Return where in the sandbox the module `name` has this text: installed, in the source folder, or both."""
    roots = ((install / ros_env.SITE_IN_PREFIX, MODULES.parent), (package, PACKAGE))
    return [str(inside / name) for host, inside in roots if untrusted.read_python(host / name) == text]


def replaceable(package: Path, install: Path) -> dict[str, tuple[str, list[str]]]:
    """Return text and sandbox paths of the modules that can be replaced wherever tests may import them from."""
    found = {}
    for name, text in texts(package, install).items():
        if text is None:
            continue
        paths = sandbox_paths(package, install, name, text)
        copies = [root / name for root in (install / ros_env.SITE_IN_PREFIX, package) if (root / name).is_file()]
        if paths and len(paths) == len(copies):
            found[name] = (text, paths)
    return found


def relative(path: Path) -> str | None:
    """Return the path of a module in the sandbox relative to the package, None for any other file."""
    root = next((root for root in (MODULES.parent, PACKAGE) if path.is_relative_to(root)), None)
    return None if root is None else str(path.relative_to(root))
