"""CSV files whose cells are only ever text or numbers to the spreadsheet that opens them."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from pathlib import Path

from grader.errors import GraderError
from grader.host.tempdir import write_atomically

# What a spreadsheet takes for the beginning of a formula (OWASP, "CSV Injection").
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")

# A byte order mark, and Excel's line that says what separates cells.
_BEFORE = re.compile('\ufeff?(?:"?sep=(?P<separator>[^"\r\n])"?(?:\r\n|\r|\n))?', re.IGNORECASE)
_MARKS = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
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
    write_atomically(path, "".join(",".join(_quoted(neutral(cell)) for cell in row) + "\n" for row in rows))


def _quoted(cell: str) -> str:
    """Return a cell in quotes where a spreadsheet of some country would end it: there cells end at a semicolon."""
    return '"' + cell.replace('"', '""') + '"' if _ENDS_A_CELL.search(cell) else cell


class Sheet:
    """A CSV file of a spreadsheet or a platform. All but the cells that are set stays byte for byte.

    Attributes:
        header: the cells of the first line.
        rows: the cells of the others, each line as long as the header.
    """

    def __init__(self, path: Path) -> None:
        """Read a file in UTF-8, or in UTF-16 with its mark, as spreadsheets save "Unicode text".

        Raises:
            GraderError: it cannot be read or is empty.
        """
        try:
            data = path.read_bytes()
            self._encoding = next((name for mark, name in _MARKS.items() if data.startswith(mark)), "utf-8")
            text = data.decode(self._encoding)
        except (OSError, UnicodeDecodeError) as error:
            raise GraderError(f"{path} cannot be read ({error}). Save it as CSV in UTF-8.") from error
        found = _BEFORE.match(text)
        assert found is not None  # all of it may be missing
        self._before, text = found[0], text[found.end() :]
        self._separator = found["separator"] or max(",;\t", key=text.partition("\n")[0].count)
        self._lines = list(_lines(text, self._separator))
        if not self._lines:
            raise GraderError(f"{path} is empty. Export it once more.")
        self.header, *self.rows = (
            [c[1:-1].replace('""', '"') if len(c) > 1 and c[0] == c[-1] == '"' else c for c in line]
            for line, _ in self._lines
        )
        for row in self.rows:
            row += [""] * (len(self.header) - len(row))

    def set(self, row: int, column: int, cell: str) -> None:
        """Set a cell of `rows`, as it is."""
        if self.rows[row][column] != cell:
            self.rows[row][column] = cell
            line, _ = self._lines[row + 1]
            line += [""] * (column + 1 - len(line))
            line[column] = _quoted(cell)

    def write(self, path: Path) -> None:
        """Write the sheet."""
        text = "".join(self._separator.join(line) + end for line, end in self._lines)
        write_atomically(path, (self._before + text).encode(self._encoding))


def _lines(text: str, separator: str) -> Iterator[tuple[list[str], str]]:
    """Yield each line's cells, with their quotes, and what ends the line."""
    # A quote that is not closed, or has something after it, is a letter like any other.
    mark = re.escape(separator)
    pattern = re.compile(rf'("(?:[^"]|"")*"|[^{mark}\r\n]*)({mark}|\r\n|\r|\n|\Z)')
    cells: list[str] = []
    for found in pattern.finditer(text):
        cell, end = found.groups()
        if found.start() == len(text) and not cells:
            return
        cells.append(cell)
        if end != separator:
            yield cells, end
            cells = []
