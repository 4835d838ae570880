"""Read folders, zips and tars as lists of entries with contents. copy_plan.py decides which of them are kept.

This module follows no link and trusts no size that an archive declares. Any exception that a library raises on a
crafted archive becomes a SubmissionError.
"""

from __future__ import annotations

import os
import stat
import struct
import tarfile
import zipfile
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import IO, NoReturn

from grader.errors import GraderError, KitError, SubmissionError
from grader.intake.names import MAX_DEPTH, tool_folder
from grader.intake.streams import CappedStream, FollowedByMore, Readable, StreamTooLong, unpacker
from grader.sanitize import printable
from grader.words import mark, say

MAX_LINK_BYTES = 4096
# After an entry's data a zip may repeat its sizes and checksum, in 24 bytes at most; before the first entry, 4 bytes
# may mark an archive that was meant to be split.
_ZIP_GAP_BYTES = 24

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


def open_container(path: Path, leave_out: Collection[Path] = (), limits: SizeLimits = SUBMISSION) -> Folder | Zip | Tar:
    """Return the container at `path`, recognised by its content, not by its name.

    It lists its `entries` in its own order, and yields the `contents` of wanted files as streams, each valid until the
    next one is read, and to be read in a block of `damaged`. Of a folder, the folders `leave_out` in it are left out,
    such as the grader's output.

    Raises:
        SubmissionError: `path` does not exist, or is neither a folder nor an archive that can be opened.
        GraderError: `path` cannot be read.
    """
    shown = printable(path.name or str(path))
    try:
        if path.is_dir():
            return Folder(path, leave_out)
        if not path.exists():
            raise SubmissionError(
                say("There is no file or folder {path}.", path=printable(str(path))), say("Check the path.")
            )
        if not path.is_file():
            raise SubmissionError(
                say("{name} is neither a folder nor a file.", name=shown),
                say("Submit the package folder or a zip of it."),
            )
        with path.open("rb") as file:
            head = file.read(512)
    except OSError as error:
        raise _unreadable(path, error) from error
    if not head:
        raise SubmissionError(
            say("{name} is an empty file.", name=shown), say("Zip the package folder and submit again.")
        )
    unpack = unpacker(head)
    zipped = head.startswith(b"PK") and zipfile.is_zipfile(path)
    if unpack is not None and zipped:
        raise _two_archives(path.name)
    if unpack is not None:
        return Tar(path, unpack, limits)
    if zipped:
        return Zip(path, limits)
    if head.startswith((b"PK", b"Rar!", b"7z\xbc\xaf")):
        raise SubmissionError(
            say("{name} is damaged, or of a kind that cannot be opened.", name=shown),
            say("Zip the package folder again."),
        )
    raise SubmissionError(
        say("{name} is not a folder, zip or tar.", name=shown), say("Zip the package folder and submit that.")
    )


class Folder:
    """A folder on disk. A file that was listed is opened only if it is no link by then."""

    def __init__(self, path: Path, leave_out: Collection[Path] = ()) -> None:
        self.name = path.resolve().name
        self._path = path
        self._leave_out = {folder.resolve() for folder in leave_out}
        self._names: list[str] = []

    def entries(self) -> list[Entry]:
        """Return the files below the folder in alphabetical order; folders that are never kept are not entered."""
        try:
            found = self._walk()
        except OSError as error:
            raise _unreadable(Path(error.filename or self._path), error) from error
        self._names = [entry.name for entry in found]
        return found

    def _walk(self) -> list[Entry]:
        found: list[Entry] = []
        for folder, folders, files, handle in os.fwalk(self._path, onerror=_raise, follow_symlinks=False):
            inside = os.path.relpath(folder, self._path)
            prefix = "" if inside == "." else inside + "/"
            if len(found) + len(files) + len(folders) > SUBMISSION.entries:
                raise _too_many(self.name, SUBMISSION)
            found += [self._entry(len(found) + i, prefix, name, handle) for i, name in enumerate(sorted(files))]
            links = [name for name in sorted(folders) if stat.S_ISLNK(os.lstat(name, dir_fd=handle).st_mode)]
            found += [self._entry(len(found) + i, prefix, name, handle) for i, name in enumerate(links)]
            # Entries one level too deep are still listed, to be noted; deeper ones could exhaust the stack of fwalk.
            deep = prefix.count("/") > MAX_DEPTH
            folders[:] = [] if deep else sorted(n for n in folders if self._entered(Path(folder, n), links))
        return found

    def _entered(self, folder: Path, links: list[str]) -> bool:
        return folder.name not in links and not tool_folder(folder.name) and folder.resolve() not in self._leave_out

    def _entry(self, index: int, prefix: str, name: str, handle: int) -> Entry:
        status = os.lstat(name, dir_fd=handle)
        if stat.S_ISLNK(status.st_mode):
            return Entry(index, prefix + name, Kind.LINK, target=os.readlink(name, dir_fd=handle))
        kind = Kind.FILE if stat.S_ISREG(status.st_mode) else Kind.SPECIAL
        return Entry(index, prefix + name, kind, status.st_size, stat.S_IMODE(status.st_mode))

    def contents(self, wanted: Collection[int]) -> Iterator[tuple[int, Readable]]:
        """Yield the wanted files."""
        for index in sorted(wanted):
            with self._open(self._names[index]) as file:
                yield index, file

    def _open(self, name: str) -> IO[bytes]:
        path = self._path / name
        try:
            return os.fdopen(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb")
        except OSError as error:
            raise _unreadable(path, error) from error


class Zip:
    """A zip archive."""

    def __init__(self, path: Path, limits: SizeLimits = SUBMISSION) -> None:
        self.name = path.name
        self._path = path
        self._limits = limits

    def entries(self) -> list[Entry]:
        """Return the entries of the central directory."""
        if _count(self._path, b"PK\x01\x02") > self._limits.entries:
            raise _too_many(self.name, self._limits)
        with self._open() as archive, damaged(self.name):
            self._require_one(archive)
            return [self._entry(archive, index, info) for index, info in enumerate(archive.infolist())]

    def _require_one(self, archive: zipfile.ZipFile) -> None:
        """Refuse a zip with entries that its directory does not list: another zip in front of it, or between."""
        end = 0
        with self._path.open("rb") as file:
            for start, packed in sorted((info.header_offset, info.compress_size) for info in archive.infolist()):
                if start > end:
                    file.seek(end)
                    if start - end > _ZIP_GAP_BYTES and b"PK" in file.read(start - end):
                        raise _two_archives(self.name)
                file.seek(start + 26)
                end = max(end, start + 30 + sum(struct.unpack("<HH", file.read(4))) + packed)
            file.seek(end)
            if archive.start_dir - end > _ZIP_GAP_BYTES and b"PK\x03\x04" in file.read(archive.start_dir - end):
                raise _two_archives(self.name)

    def _entry(self, archive: zipfile.ZipFile, index: int, info: zipfile.ZipInfo) -> Entry:
        mode, name = info.external_attr >> 16, _name(info)
        if info.is_dir():
            return Entry(index, name, Kind.FOLDER)
        if info.flag_bits & 1:
            raise SubmissionError(
                say("{name} is protected by a password.", name=printable(self.name)),
                say("Submit it without a password."),
            )
        if stat.S_ISLNK(mode):
            target = b""
            if info.file_size <= MAX_LINK_BYTES:
                with archive.open(info) as file:
                    target = file.read(MAX_LINK_BYTES)
            return Entry(index, name, Kind.LINK, target=os.fsdecode(target))
        plain = stat.S_IFMT(mode) in (0, stat.S_IFREG)
        kind = Kind.FILE if plain else Kind.SPECIAL
        return Entry(index, name, kind, info.file_size, stat.S_IMODE(mode), packed=info.compress_size)

    def contents(self, wanted: Collection[int]) -> Iterator[tuple[int, Readable]]:
        """Yield the wanted files."""
        with self._open() as archive:
            infos = archive.infolist()
            for index in sorted(wanted):
                with damaged(self.name):
                    file = archive.open(infos[index])
                with file:
                    yield index, file

    def _open(self) -> zipfile.ZipFile:
        with damaged(self.name):
            return zipfile.ZipFile(self._path)


def _name(info: zipfile.ZipInfo) -> str:
    """Return an entry's name, as UTF-8 where its bytes are that, even without the flag; macOS leaves it out."""
    if info.flag_bits & 0x800:
        return info.filename
    try:
        return info.filename.encode("cp437").decode()
    except UnicodeError:
        return info.filename


class Tar:
    """A tar archive, compressed or not. Read only from front to back, so a crafted offset cannot make it loop."""

    def __init__(self, path: Path, unpacker: Callable[[IO[bytes]], Readable], limits: SizeLimits = SUBMISSION) -> None:
        self.name = path.name
        self._path = path
        self._limits = limits
        self._unpacker = unpacker

    def entries(self) -> list[Entry]:
        """Return the entries in the order of the archive."""
        found: list[Entry] = []
        try:
            for index, member, _ in self._members():
                if index >= self._limits.entries:
                    raise _too_many(self.name, self._limits)
                found.append(_tar_entry(index, member))
        except StreamTooLong:
            raise SubmissionError(
                say(
                    "{name} unpacks to more than {most} MB. The largest of its first files are {largest}.",
                    name=printable(self.name),
                    most=self._limits.tar_bytes // MB,
                    largest=largest({entry.name: entry.size for entry in found}),
                ),
                say("Submit the package folder only, without recordings, build trees and virtual environments."),
            ) from None
        return found

    def contents(self, wanted: Collection[int]) -> Iterator[tuple[int, Readable]]:
        """Yield the wanted files."""
        for index, member, archive in self._members():
            if index in wanted:
                with damaged(self.name):
                    file = archive.extractfile(member)
                if file is not None:
                    yield index, file

    def _members(self) -> Iterator[tuple[int, tarfile.TarInfo, tarfile.TarFile]]:
        with self._path.open("rb") as file:
            with damaged(self.name):
                stream = CappedStream(self._unpacker(file), self._limits.tar_bytes)
                archive = tarfile.open(fileobj=stream, mode="r|", errorlevel=2)  # type: ignore[call-overload]  # noqa: SIM115
            # Typeshed asks for more than read(), which is all that a stream needs.
            with archive:
                index = 0
                while True:
                    with damaged(self.name):
                        member = archive.next()
                    if member is None:
                        self._require_end(archive)
                        return
                    # TarFile remembers every member; this one is never asked for them again.
                    archive.members = []
                    yield index, member, archive
                    index += 1

    def _require_end(self, archive: tarfile.TarFile) -> None:
        """Refuse a tar that is followed by something else, such as a second archive: `tar` would not show that."""
        with damaged(self.name):
            while block := archive.fileobj.read(tarfile.RECORDSIZE):
                if block.strip(b"\0"):
                    raise _two_archives(self.name)


def _tar_entry(index: int, member: tarfile.TarInfo) -> Entry:
    if member.isdir():
        return Entry(index, member.name, Kind.FOLDER)
    if member.issym():
        return Entry(index, member.name, Kind.LINK, target=member.linkname)
    if member.islnk():
        return Entry(index, member.name, Kind.HARD_LINK, target=member.linkname)
    plain = member.isreg() and not member.issparse()
    return Entry(index, member.name, Kind.FILE if plain else Kind.SPECIAL, member.size, stat.S_IMODE(member.mode))


def _two_archives(name: str) -> SubmissionError:
    return SubmissionError(
        say(
            "{name} holds more than one archive in one file, and programs differ in which of them they show.",
            name=printable(name),
        ),
        say("Zip the package folder again, into a new file."),
    )


@contextmanager
def damaged(name: str) -> Iterator[None]:
    """Turn any exception of a library into a SubmissionError that says that the archive `name` is damaged."""
    try:
        yield
    except (KitError, StreamTooLong):
        raise
    except FollowedByMore:
        raise _two_archives(name) from None
    except NotImplementedError as error:
        raise SubmissionError(
            say(
                "{name} is compressed in a way that cannot be opened here ({why}).",
                name=printable(name),
                why=printable(str(error)),
            ),
            say("Zip it again with the usual method."),
        ) from error
    except Exception as error:
        # On crafted bytes, archive parsers raise all sorts of exceptions; to the reader they all mean the same.
        raise SubmissionError(
            say("{name} is damaged ({why}).", name=printable(name), why=printable(str(error)) or say("unreadable")),
            say("Pack it again."),
        ) from error


def _count(path: Path, signature: bytes) -> int:
    """Return how often `signature` occurs in the file: an upper bound of its entries, found without parsing it."""
    count, tail = 0, b""
    with path.open("rb") as file:
        while block := file.read(1024**2):
            data = tail + block
            count += data.count(signature)
            tail = data[-len(signature) + 1 :]
    return count


def largest(sizes: Mapping[str, int]) -> str:
    """Return the names and sizes of the largest files as text."""
    names = sorted(sizes, key=lambda name: (-sizes[name], name))[:MAX_LARGEST]
    return ", ".join(f"{printable(name)} ({max(1, sizes[name] // MB)} MB)" for name in names)


def _too_many(name: str, limits: SizeLimits) -> SubmissionError:
    return SubmissionError(
        say("{name} contains more than {most} files.", name=printable(name), most=limits.entries),
        say("Submit the package folder only, without build trees and virtual environments."),
    )


def _unreadable(path: Path, error: OSError) -> GraderError:
    words = mark("Cannot read {path}: {why}. Make the submission readable, and do not change it while it is graded.")
    return GraderError(say(words, path=printable(str(path)), why=error.strerror))


def _raise(error: OSError) -> NoReturn:
    raise error
