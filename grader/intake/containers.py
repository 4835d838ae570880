"""Read folders, zips and tars as lists of entries with contents. copy_plan.py decides which of them are kept.

This module follows no link and trusts no size that an archive declares. Any exception that a library raises on a
crafted archive becomes a SubmissionError.
"""

from __future__ import annotations

import bz2
import itertools
import lzma
import os
import stat
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import IO, Any, NoReturn

from grader.errors import GraderError, KitError, SubmissionError
from grader.intake.names import MAX_DEPTH, tool_folder
from grader.sanitize import printable
from grader.words import mark, say

MAX_LINK_BYTES = 4096
# After an entry's data a zip may repeat its sizes and checksum, in 24 bytes at most; before the first entry, 4 bytes
# may mark an archive that was meant to be split.
_ZIP_GAP_BYTES = 24
# An xz file declares its dictionary size, up to 4 GiB; `xz -9` needs 65 MiB.
MAX_LZMA_MEMORY = 256 * 1024**2

MAX_LARGEST = 3  # files named when there is too much

ARCHIVE_SUFFIXES = (".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tbz2", ".tbz", ".tar.xz", ".txz")
CLOSED_ARCHIVES = (".rar", ".7z", ".zst", ".iso")
"""Archives that are not opened."""

MB = 1024**2


@dataclass(frozen=True)
class SizeLimits:
    """The size that a submission may have. The reference package has 60 files and 0.2 MB."""

    total_bytes: int = 50 * MB
    file_bytes: int = 10 * MB
    files: int = 5000
    # Text is packed 3 to 10 times smaller; a map or a log of one value 200 times, but those are small.
    ratio: int = 100
    ratio_applies_above_bytes: int = 5 * MB
    # How far an archive is read: 20 times the files that may be kept, and what a tar unpacks to with its build trees.
    entries: int = 100_000
    tar_bytes: int = 250 * MB


SUBMISSION = SizeLimits()


class Kind(Enum):
    """The type of an entry."""

    FILE = "file"
    FOLDER = "folder"
    LINK = "link"
    HARD_LINK = "hard link"
    SPECIAL = "special"


@dataclass(frozen=True)
class Entry:
    """One entry as the container declares it; do not trust any of it. `packed` is its size in the archive."""

    index: int
    name: str
    kind: Kind
    size: int = 0
    mode: int = 0o644
    target: str = ""
    packed: int | None = None


@dataclass(frozen=True)
class Container:
    """A folder or an archive, whose size is `packed_bytes`; `entries` are in its own order.

    `contents` yields wanted files by their index as streams, each valid until the next one is read, and to be read in a
    block of `damaged`.
    """

    name: str
    entries: list[Entry]
    contents: Callable[[Collection[int]], Iterator[tuple[int, IO[bytes]]]]
    packed_bytes: int | None = None


def open_container(path: Path, leave_out: Collection[Path] = (), limits: SizeLimits = SUBMISSION) -> Container:
    """Return the container at `path`, recognised by its content, not by its name.

    Of a folder, the folders `leave_out` in it are left out, such as the grader's output.

    Raises:
        SubmissionError: `path` does not exist, or is neither a folder nor an archive that can be opened.
        GraderError: `path` cannot be read.
    """
    name = path.name or str(path)
    with _readable(path):
        if path.is_dir():
            return folder(path, leave_out)
        if not path.is_file():
            words = mark("There is no file or folder {path}.")
            raise refused(name, words, mark("Check the path."), path=printable(str(path)))
        with path.open("rb") as file:
            head = file.read(512)
        zipped = head.startswith(b"PK") and zipfile.is_zipfile(path)
    if not head:
        raise refused(name, mark("{name} is an empty file."), mark("Zip the package folder and submit again."))
    magic = next(filter(head.startswith, _DECOMPRESSORS), b"")
    tarred = magic or head[257:262] == b"ustar"
    if tarred and zipped:
        raise _two_archives(name)
    if tarred:
        return _tar(path, magic, limits)
    if zipped:
        return _zip(path, limits)
    if head.startswith((b"PK", b"Rar!", b"7z\xbc\xaf")):
        words = mark("{name} is damaged, or of a kind that cannot be opened.")
        raise refused(name, words, mark("Zip the package folder again."))
    raise refused(name, mark("{name} is not a folder, zip or tar."), mark("Zip the package folder and submit that."))


# -- folders ----------------------------------------------------------------------------------------------------------
def folder(path: Path, leave_out: Collection[Path] = ()) -> Container:
    """Return a folder on disk: its files in alphabetical order. Folders that are never kept are not entered.

    A file that was listed is opened only if it is no link by then.
    """
    left_out, name = {each.resolve() for each in leave_out}, path.resolve().name
    entries: list[Entry] = []
    with _readable(path):
        for here, folders, files, handle in os.fwalk(path, onerror=_raise, follow_symlinks=False):
            inside = os.path.relpath(here, path)
            prefix = "" if inside == "." else inside + "/"
            if len(entries) + len(files) + len(folders) > SUBMISSION.entries:
                raise _too_many(name, SUBMISSION)
            links = [each for each in sorted(folders) if stat.S_ISLNK(os.lstat(each, dir_fd=handle).st_mode)]
            for each in (*sorted(files), *links):
                entries.append(_on_disk(len(entries), prefix, each, handle))
            # Entries one level too deep are still listed, to be noted; deeper ones could exhaust the stack of fwalk.
            folders[:] = [] if prefix.count("/") > MAX_DEPTH else sorted(
                each for each in set(folders) - set(links)
                if not tool_folder(each) and Path(here, each).resolve() not in left_out
            )  # fmt: skip

    def contents(wanted: Collection[int]) -> Iterator[tuple[int, IO[bytes]]]:
        for index in sorted(wanted):
            place = path / entries[index].name
            with _readable(place), os.fdopen(os.open(place, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as file:
                yield index, file

    return Container(name, entries, contents)


def _on_disk(index: int, prefix: str, name: str, handle: int) -> Entry:
    status = os.lstat(name, dir_fd=handle)
    if stat.S_ISLNK(status.st_mode):
        return Entry(index, prefix + name, Kind.LINK, target=os.readlink(name, dir_fd=handle))
    kind = Kind.FILE if stat.S_ISREG(status.st_mode) else Kind.SPECIAL
    return Entry(index, prefix + name, kind, status.st_size, stat.S_IMODE(status.st_mode))


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Turn an OSError from reading the submission into a GraderError."""
    try:
        yield
    except OSError as error:
        words = mark(
            "Cannot read {path}: {why}. Make the submission readable, and do not change it while it is graded."
        )
        raise GraderError(say(words, path=printable(str(error.filename or path)), why=error.strerror)) from error


def _raise(error: OSError) -> NoReturn:
    raise error


# -- zips -------------------------------------------------------------------------------------------------------------
def _zip(path: Path, limits: SizeLimits) -> Container:
    """Return a zip archive with the entries of its central directory."""
    if _count(path, b"PK\x01\x02") > limits.entries:
        raise _too_many(path.name, limits)
    with damaged(path.name), zipfile.ZipFile(path) as archive:
        _require_one_zip(path, archive)
        entries = [_in_zip(path.name, archive, index, info) for index, info in enumerate(archive.infolist())]

    def contents(wanted: Collection[int]) -> Iterator[tuple[int, IO[bytes]]]:
        with damaged(path.name), zipfile.ZipFile(path) as archive:
            infos = archive.infolist()
            for index in sorted(wanted):
                with archive.open(infos[index]) as file:
                    yield index, file

    return Container(path.name, entries, contents, path.stat().st_size)


def _count(path: Path, signature: bytes) -> int:
    """Return how often `signature` occurs in the file: an upper bound of its entries, found without parsing it."""
    count, tail = 0, b""
    with path.open("rb") as file:
        while block := file.read(1024**2):
            data = tail + block
            count += data.count(signature)
            tail = data[-len(signature) + 1 :]
    return count


def _require_one_zip(path: Path, archive: zipfile.ZipFile) -> None:
    """Refuse a zip with entries that its directory does not list: another zip in front of it, or between."""
    end = 0
    with path.open("rb") as file:
        for start, packed in sorted((info.header_offset, info.compress_size) for info in archive.infolist()):
            if start > end:
                file.seek(end)
                if start - end > _ZIP_GAP_BYTES and b"PK" in file.read(start - end):
                    raise _two_archives(path.name)
            file.seek(start + 26)
            end = max(end, start + 30 + sum(struct.unpack("<HH", file.read(4))) + packed)
        file.seek(end)
        if archive.start_dir - end > _ZIP_GAP_BYTES and b"PK\x03\x04" in file.read(archive.start_dir - end):
            raise _two_archives(path.name)


def _in_zip(name: str, archive: zipfile.ZipFile, index: int, info: zipfile.ZipInfo) -> Entry:
    mode, path = info.external_attr >> 16, info.filename
    if not info.flag_bits & 0x800:  # macOS leaves out the flag that says that a name is UTF-8
        with suppress(UnicodeError):
            path = path.encode("cp437").decode()
    if info.is_dir():
        return Entry(index, path, Kind.FOLDER)
    if info.flag_bits & 1:
        raise refused(name, mark("{name} is protected by a password."), mark("Submit it without a password."))
    if stat.S_ISLNK(mode):
        target = b""
        if info.file_size <= MAX_LINK_BYTES:
            with archive.open(info) as file:
                target = file.read(MAX_LINK_BYTES)
        return Entry(index, path, Kind.LINK, target=os.fsdecode(target))
    kind = Kind.FILE if stat.S_IFMT(mode) in (0, stat.S_IFREG) else Kind.SPECIAL
    return Entry(index, path, kind, info.file_size, stat.S_IMODE(mode), packed=info.compress_size)


# -- tars -------------------------------------------------------------------------------------------------------------
def _tar(path: Path, magic: bytes, limits: SizeLimits) -> Container:
    """Return a tar archive. It is read only from front to back, so a crafted offset cannot make it loop."""

    def members() -> Iterator[tuple[int, tarfile.TarInfo, tarfile.TarFile]]:
        with path.open("rb") as file, damaged(path.name):
            stream: Any = _Unpacked(path.name, file, magic, limits.tar_bytes)  # read() is all that is asked of it
            with tarfile.open(fileobj=stream, mode="r|", errorlevel=2) as archive:
                for index in itertools.count():
                    if (member := archive.next()) is None:
                        break
                    # TarFile remembers every member; this one is never asked for them again.
                    archive.members = []  # type: ignore[attr-defined]  # it is there, not in typeshed
                    yield index, member, archive
                # What follows is something else, such as a second archive: `tar` would not show that.
                while block := archive.fileobj.read(tarfile.RECORDSIZE):
                    if block.strip(b"\0"):
                        raise _two_archives(path.name)

    def contents(wanted: Collection[int]) -> Iterator[tuple[int, IO[bytes]]]:
        for index, member, archive in members():
            if index in wanted:
                with damaged(path.name):
                    file = archive.extractfile(member)
                if file is not None:
                    yield index, file

    entries: list[Entry] = []
    try:
        for index, member, _ in members():
            if index >= limits.entries:
                raise _too_many(path.name, limits)
            entries.append(_in_tar(index, member))
    except StreamTooLong:
        raise refused(
            path.name,
            mark("{name} unpacks to more than {most} MB. The largest of its first files are {largest}."),
            mark("Submit the package folder only, without recordings, build trees and virtual environments."),
            most=limits.tar_bytes // MB,
            largest=largest({entry.name: entry.size for entry in entries}),
        ) from None
    return Container(path.name, entries, contents, path.stat().st_size)


def _in_tar(index: int, member: tarfile.TarInfo) -> Entry:
    if member.isdir():
        return Entry(index, member.name, Kind.FOLDER)
    if member.issym() or member.islnk():
        return Entry(index, member.name, Kind.LINK if member.issym() else Kind.HARD_LINK, target=member.linkname)
    plain = member.isreg() and not member.issparse()
    return Entry(index, member.name, Kind.FILE if plain else Kind.SPECIAL, member.size, stat.S_IMODE(member.mode))


_DECOMPRESSORS: dict[bytes, Callable[[], Any]] = {
    b"\x1f\x8b": lambda: zlib.decompressobj(wbits=31),
    b"BZh": bz2.BZ2Decompressor,
    b"\xfd7zXZ\x00": lambda: lzma.LZMADecompressor(memlimit=MAX_LZMA_MEMORY),
}
"""The compressions that a tar may have, by the first bytes of the file."""


class StreamTooLong(Exception):
    """A stream is longer than its limit."""


class _Unpacked:
    """What a tar's file unpacks to, up to a limit. Several streams in it are read as one, as gzip, bzip2 and xz do."""

    def __init__(self, name: str, file: IO[bytes], magic: bytes, max_bytes: int) -> None:
        self._name, self._file, self._magic, self._left = name, file, magic, max_bytes
        self._decompressor: Any = _DECOMPRESSORS[magic]() if magic else None
        self._packed = b""

    def read(self, size: int = -1) -> bytes:
        """Return at most `size` bytes, which have to be said."""
        if not 0 <= size <= self._left:
            raise StreamTooLong
        data = self._file.read(size) if self._decompressor is None else self._unpack(size)
        self._left -= len(data)
        return data

    def _unpack(self, size: int) -> bytes:
        while not self._decompressor.eof or self._begin_next():
            # zlib hands back what it has not used yet; the others keep it, and say when they need more.
            hungry = not self._packed and getattr(self._decompressor, "needs_input", True)
            packed = self._file.read(64 * 1024) if hungry else self._packed
            if hungry and not packed:
                raise EOFError("the packed stream ends early")
            data: bytes = self._decompressor.decompress(packed, size)
            self._packed = getattr(self._decompressor, "unconsumed_tail", b"")
            if data:
                return data
        return b""

    def _begin_next(self) -> bool:
        """Begin with the stream that follows; False if there is none. Zero bytes between streams are padding."""
        rest = self._decompressor.unused_data.lstrip(b"\0")
        while len(rest) < len(self._magic) and (block := self._file.read(64 * 1024)):
            rest = (rest + block).lstrip(b"\0")
        if rest and not rest.startswith(self._magic):
            raise _two_archives(self._name)
        if rest:
            self._decompressor, self._packed = _DECOMPRESSORS[self._magic](), rest
        return bool(rest)


# -- refusals ---------------------------------------------------------------------------------------------------------
def refused(name: str, words: str, advice: str, **fields: object) -> SubmissionError:
    """Return the error of a container: `words` with its `name` and other fields, and advice."""
    return SubmissionError(say(words, name=printable(name), **fields), say(advice))


@contextmanager
def damaged(name: str) -> Iterator[None]:
    """Turn any exception of a library into a SubmissionError that says that the archive `name` is damaged."""
    try:
        yield
    except (KitError, StreamTooLong):
        raise
    except NotImplementedError as error:
        words = mark("{name} is compressed in a way that cannot be opened here ({why}).")
        raise refused(name, words, mark("Zip it again with the usual method."), why=printable(str(error))) from error
    except Exception as error:
        # On crafted bytes, archive parsers raise all sorts of exceptions; to the reader they all mean the same.
        why = printable(str(error)) or say("unreadable")
        raise refused(name, mark("{name} is damaged ({why})."), mark("Pack it again."), why=why) from error


def largest(sizes: Mapping[str, int]) -> str:
    """Return the names and sizes of the largest files as text."""
    names = sorted(sizes, key=lambda name: (-sizes[name], name))[:MAX_LARGEST]
    return ", ".join(f"{printable(name)} ({max(1, sizes[name] // MB)} MB)" for name in names)


def _two_archives(name: str) -> SubmissionError:
    words = mark("{name} holds more than one archive in one file, and programs differ in which of them they show.")
    return refused(name, words, mark("Zip the package folder again, into a new file."))


def _too_many(name: str, limits: SizeLimits) -> SubmissionError:
    words = mark("{name} contains more than {most} files.")
    advice = mark("Submit the package folder only, without build trees and virtual environments.")
    return refused(name, words, advice, most=limits.entries)
