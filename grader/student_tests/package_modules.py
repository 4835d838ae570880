"""The package's own Python modules: their texts, and where they are in the sandbox that runs the tests."""

from __future__ import annotations

from pathlib import Path

from grader import building
from grader.host import ros_env
from grader.sandbox import untrusted

PACKAGE = Path("/ws/package")
"""The source folder, inside the sandbox."""
MODULES = building.INSTALL / ros_env.SITE_IN_PREFIX
"""The folder of the installed modules, inside the sandbox: that of the package itself and any other Python package."""
# Every Python package may have such folders with its types; the build makes sure that they hold nothing else.
_GENERATED = ("msg", "srv", "action")
_TESTS = ("test", "tests")


def texts(package: Path, install: Path) -> dict[str, str | None]:
    """Return the text of each of the package's Python modules by its path below the folder of all installed modules.

    All that is installed counts, in whichever Python package; if nothing is, the modules of the source folder do.
    Generated modules and tests are left out. The text is None where `untrusted.read_python` cannot read it.
    """
    site = install / ros_env.SITE_IN_PREFIX
    paths = [path for path in site.rglob("*.py") if _is_own(path.relative_to(site))]
    if not paths:
        folders = [path.parent for path in package.glob("*/__init__.py") if path.parent.name not in _TESTS]
        site, paths = package, [path for folder in folders for path in folder.rglob("*.py")]
    regular = (path for path in sorted(paths) if path.is_file() and not path.is_symlink())
    return {str(path.relative_to(site)): untrusted.read_python(path) for path in regular}


def _is_own(path: Path) -> bool:
    return path.parts[0] not in _TESTS and not (len(path.parts) > 2 and path.parts[1] in _GENERATED)


def source_folders(package: Path, install: Path) -> list[str]:
    """Return where in the sandbox the source folders of the package's modules are."""
    names = sorted({Path(path).parts[0] for path in texts(package, install)})
    return [str(PACKAGE / name) for name in names if (package / name).is_dir()]


def sandbox_paths(package: Path, install: Path, name: str, text: str) -> list[str]:
    """Return where in the sandbox the module `name` has this text: installed, in the source folder, or both."""
    roots = ((install / ros_env.SITE_IN_PREFIX, MODULES), (package, PACKAGE))
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
    root = next((root for root in (MODULES, PACKAGE) if path.is_relative_to(root)), None)
    return None if root is None else str(path.relative_to(root))
