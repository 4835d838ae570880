"""The package's own Python modules: their texts, and where they are in the sandbox that runs the tests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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


def copies(package: Path, install: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the texts of these modules by their paths in the sandbox: installed, and in the source folder."""
    roots = ((install / ros_env.SITE_IN_PREFIX, MODULES), (package, PACKAGE))
    paths = {str(inside / name): host / name for name in names for host, inside in roots}
    return {inside: text for inside, path in paths.items() if (text := untrusted.read_python(path)) is not None}


def handed_in(package: Path, modules: Mapping[str, str | None]) -> dict[str, str]:
    """Return where in the package each module is that the build installs from another place, by its installed path."""
    elsewhere = {name for name in modules if not (package / name).is_file()}
    same: dict[str | None, list[Path]] = {}
    for path in (path.relative_to(package) for path in sorted(package.rglob("*.py")) if elsewhere):
        if path.parts[0] not in _TESTS:
            same.setdefault(untrusted.read_python(package / path), []).append(path)
    found = {
        name: sorted(same.get(modules[name], ()), key=lambda path: path.name != Path(name).name) for name in elsewhere
    }
    return {name: str(paths[0]) if paths else name for name, paths in found.items()}


def relative(path: Path) -> str | None:
    """Return the path of a module in the sandbox relative to the package, None for any other file."""
    root = next((root for root in (MODULES, PACKAGE) if path.is_relative_to(root)), None)
    return None if root is None else str(path.relative_to(root))
