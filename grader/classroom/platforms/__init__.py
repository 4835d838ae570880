"""The learning platforms that the kit knows, one module each (docs/classes.md has their formats)."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from grader.classroom import ledger
from grader.classroom.ledger import Source
from grader.classroom.platform import Export, Platform, entries_of, has, inside, is_archive
from grader.errors import GraderError


def all_platforms() -> Mapping[str, Platform]:
    """Return every platform by its name: the `PLATFORM` of each module in this package."""
    modules = (importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__))
    return {module.PLATFORM.name: module.PLATFORM for module in modules}


def read(source: Source) -> Export:
    """Return the submissions in a folder, and account for all its entries.

    Raises:
        GraderError: the folder is one package, or holds no submission.
    """
    root = _innermost(source.folder)
    entries = entries_of(root)
    names = {entry.name for entry in entries}
    if "package.xml" in names or "src" in names:
        raise GraderError(f"{root} is a single submission. Grade it with `grader grade {root} --out OUT`.")
    platform = _recognised(root, entries)
    export = ledger.account(platform.read(root, entries), platform, root, source)
    if not export.hand_ins and not any(each.sure for each in export.lost):
        raise GraderError(
            f"{root} holds no submission: neither an archive nor a folder. "
            "Name the folder or the archive that the learning platform exported."
        )
    return export


def _recognised(root: Path, entries: Sequence[Path]) -> Platform:
    """Return the platform that wrote the folder; `plain`, which takes any, is asked last."""
    *known, plain = sorted(all_platforms().values(), key=lambda platform: platform.layout == "plain")
    found = next((platform for platform in known if platform.recognises(root, entries)), None)
    return found or plain


def _innermost(root: Path) -> Path:
    """Return the folder with the submissions: an archive often has one folder around them."""
    while (
        len(entries := entries_of(root)) == 1
        and entries[0].is_dir()
        and _recognised(root, entries).layout == "plain"
        and not _is_package(entries[0])
        and any(is_archive(child) or child.is_dir() for child in inside(entries[0]))
        and not (len(below := [each for each in inside(entries[0]) if each.is_dir()]) == 1 and _is_package(below[0]))
    ):
        root = entries[0]
    return root


def _is_package(folder: Path) -> bool:
    return any(has(folder, name) for name in ("package.xml", "src"))
