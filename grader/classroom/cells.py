"""CSV files whose cells are only ever text or numbers to the spreadsheet that opens them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from decimal import Decimal
from pathlib import Path

from grader.classroom.roster import delimiter
from grader.errors import GraderError
from grader.host.atomic import write_atomically

# What a spreadsheet takes for the beginning of a formula (OWASP, "CSV Injection").
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")

_ENDS_A_CELL = re.compile('[",;\t\r\n]')

Cell = str | int | Decimal | None


def neutral(cell: Cell) -> str:
    """Return a cell as text that no spreadsheet takes for a formula; a number stays a number, None is empty."""
    if cell is None:
        return ""
    if isinstance(cell, int | Decimal):
        return str(cell)
    return f"'{cell}" if cell.startswith(_FORMULA) else cell


def write(path: Path, rows: Iterable[Sequence[Cell]]) -> None:
    """Write rows as CSV in UTF-8, every cell neutral."""
    write_as_read(path, ([neutral(cell) for cell in row] for row in rows), ",")


def write_as_read(path: Path, rows: Iterable[Sequence[str]], separator: str) -> None:
    """Write the rows of a sheet that `read` returned; a cell that nobody filled in stays as the platform wrote it."""
    write_atomically(path, "".join(separator.join(map(_quoted, row)) + "\n" for row in rows))


def _quoted(cell: str) -> str:
    """Return a cell in quotes where a spreadsheet of some country would end it: there cells end at a semicolon."""
    return '"' + cell.replace('"', '""') + '"' if _ENDS_A_CELL.search(cell) else cell


def read(path: Path) -> tuple[list[list[str]], str]:
    """Return the rows of a CSV file that a platform wrote, and what separates its cells.

    Raises:
        GraderError: it cannot be read or is empty.
    """
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise GraderError(f"{path} cannot be read ({error}). Export it once more, as CSV in UTF-8.") from error
    separator = delimiter(text)
    rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))
    if not rows:
        raise GraderError(f"{path} is empty. Export it once more.")
    return rows, separator


def unknown(names: Iterable[str]) -> list[str]:
    """Return a remark on each person of a sheet whom the gradebook does not know."""
    return [f"the gradebook does not know {name}; the line stays as it was." for name in names]
