"""Make the export of a made-up class from the reference, its variants and known-bad submissions.

    PYTHONPATH=.:tests python -m submissions.class_export FOLDER [COUNT]

FOLDER gets `export/` (as Gradescope exports: times, people, a folder for each submission), `roster.csv` and
`overrides.yaml`. Among COUNT submissions (60 by default) are two that cannot be opened, an empty one, a hostile one and
late ones; one team of the roster hands in nothing.
"""

from __future__ import annotations

import csv
import datetime as dt
import itertools
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from variants import VARIANTS
from variants import make as make_variant

from submissions.edits import EDITS, apply

DEADLINE = dt.datetime(2026, 11, 20, 23, 59, tzinfo=dt.UTC)
_DAMAGED = ("damaged_zip", "not_a_zip", "empty", "hostile")


def kinds() -> Iterator[str]:
    """Return what is handed in: the reference, the variants, what cannot be graded, then each known-bad one."""
    yield from ("reference", *VARIANTS, *_DAMAGED)
    yield from itertools.cycle(EDITS)


def make(folder: Path, count: int) -> None:
    """Write the export of a class with `count` submissions of two people each."""
    export = folder / "export"
    export.mkdir(parents=True)
    metadata, people = [], []
    for number, kind in enumerate(itertools.islice(kinds(), count), 1):
        team = f"team{number:02}"
        members = [(f"s{number:02}{letter}", f"{letter.upper()}da Example{number:02}") for letter in "ab"]
        people += [(name, words, f"{name}@uni.example", name, team) for name, words in members]
        _hand_in(kind, export / f"submission_{number}")
        submitted = DEADLINE + dt.timedelta(hours=30 if number % 10 == 0 else -number)
        said = "".join(f"  - :name: {who}\n    :sid: {sid}\n    :email: {sid}@uni.example\n" for sid, who in members)
        metadata.append(f"submission_{number}:\n  :submitters:\n{said}  :created_at: {submitted:%Y-%m-%d %H:%M:%S} Z\n")
    (export / "submission_metadata.yml").write_text("".join(metadata))
    people += [(f"s{count + 1}{letter}", f"{letter.upper()}da Absent", "", "", f"team{count + 1}") for letter in "ab"]
    with (folder / "roster.csv").open("w", newline="") as stream:
        csv.writer(stream).writerows([("id", "name", "email", "login", "team"), *people])
    (folder / "overrides.yaml").write_text(
        "submissions:\n  team01:\n    points:\n      F4: {points: 4, why: an example, by: Ada}\n"
        "people:\n  s10a:\n    extension: {until: 2026-11-30T00:00+00:00, why: ill, by: Ada}\n"
    )


def _hand_in(kind: str, folder: Path) -> None:
    """Write one submission into the new folder `folder`."""
    folder.mkdir()
    if kind == "damaged_zip":
        with tempfile.TemporaryDirectory() as scratch:
            packed = Path(shutil.make_archive(f"{scratch}/team", "zip", apply(None, Path(scratch))))
            (folder / "team.zip").write_bytes(packed.read_bytes()[:-3000])
    elif kind == "not_a_zip":
        (folder / "team.zip").write_text("see the link in the forum")
    elif kind == "empty":
        (folder / ".gitkeep").touch()
    elif kind == "hostile":
        package = apply(None, folder)
        setup = package / "CMakeLists.txt"
        setup.write_text('execute_process(COMMAND sh -c "kill -9 -1; rm -rf /ws /home")\n' + setup.read_text())
    elif kind == "reference":
        apply(None, folder)
    elif kind in EDITS:
        apply(EDITS[kind], folder)
    else:
        make_variant(VARIANTS[kind], folder)


def main(arguments: list[str]) -> int:
    """Make the class that the command line names."""
    folder, count = Path(arguments[0]), int(arguments[1]) if len(arguments) > 1 else 60
    make(folder, count)
    print(f"{folder}: {count} submissions")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
