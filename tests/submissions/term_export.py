"""Make what docs/term.md begins with: two sheets as Moodle exports them, with their worksheets, and a roster.

    PYTHONPATH=.:tests python -m submissions.term_export FOLDER

Jane and Li are team07, Bo hands in too late, Eva what students of other courses wrote, and Ada nothing.
"""

from __future__ import annotations

import csv
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path

from submissions.class_export import hand_in

STRANGERS = Path(__file__).parent / "strangers"
PEOPLE = (
    ("s1230", "Jane Doe", "jane.doe@uni.example", "team07"),
    ("s1231", "Li Wu", "li.wu@uni.example", "team07"),
    ("s1232", "Bo Ek", "bo.ek@uni.example", ""),
    ("s1234", "Eva Ost", "eva.ost@uni.example", ""),
    ("s1235", "Ada Absent", "ada@uni.example", ""),
)
HANDED_IN = {
    "s1230": ("stops_late", "Friday, {} {}, 8:14 PM"),
    "s1232": ("drives_into_the_wall", "Saturday, {} {}, 11:02 AM"),
    "s1234": ("many_threads.zip", "Thursday, {} {}, 9:30 AM"),
}
"""What each person handed in, and when, with room for the day and the month."""
SHEETS = {"sheet1": (("20", "21", "19"), "November 2026"), "sheet2": (("18", "19", "17"), "December 2026")}


def make(folder: Path) -> None:
    """Write the exports, the worksheets and the roster into `folder`."""
    with (folder / "roster.csv").open("w", newline="") as stream:
        csv.writer(stream).writerows([("id", "name", "email", "team"), *PEOPLE])
    for number, (sheet, (days, month)) in enumerate(SHEETS.items(), 1):
        times = {who: when.format(day, month) for (who, (_, when)), day in zip(HANDED_IN.items(), days, strict=True)}
        _export(folder / f"{sheet}.zip", number)
        _worksheet(folder / f"{sheet}_worksheet.csv", number, times)


def _export(path: Path, number: int) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        export = Path(scratch) / "export"
        for place, (who, name, *_) in enumerate(PEOPLE):
            if who in HANDED_IN:
                kind = HANDED_IN[who][0]
                entry = export / f"{name}_{number}000{place}_assignsubmission_file"
                entry.mkdir(parents=True)
                if (stranger := STRANGERS / kind).is_file():
                    shutil.copy(stranger, entry / "package.zip")
                else:
                    hand_in(kind, Path(scratch) / kind)
                    shutil.make_archive(str(entry / "package"), "zip", Path(scratch) / kind)
        with zipfile.ZipFile(path, "w") as archive:
            for file in sorted(export.rglob("*.zip")):
                archive.write(file, file.relative_to(export))


def _worksheet(path: Path, number: int, times: dict[str, str]) -> None:
    header = (
        "Identifier", "Full name", "ID number", "Email address", "Status", "Grade", "Maximum Grade",
        "Grade can be changed", "Last modified (submission)", "Last modified (grade)", "Feedback comments",
    )  # fmt: skip
    rows = [
        (
            f"Participant {number}000{place}", name, who, email, "Submitted for grading" if who in times else "-",
            "", "100.00", "Yes", times.get(who, "-"), "-", "See me. A. Lee" if who == "s1232" else "",
        )
        for place, (who, name, email, _) in enumerate(PEOPLE)
    ]  # fmt: skip
    with path.open("w", newline="", encoding="utf-8-sig") as stream:
        csv.writer(stream, lineterminator="\n").writerows([header, *rows])


if __name__ == "__main__":
    make(Path(sys.argv[1]))
