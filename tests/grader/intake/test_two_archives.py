"""Two archives in one file: programs differ in which they show, so such a file is refused."""

from __future__ import annotations

import bz2
import gzip
import lzma
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import IO, cast

import pytest
from helpers.archives import below, member, refusal, tarred, zipped
from helpers.course import COURSE

from grader.intake.submission import open_submission

SHOWN, HIDDEN = below("shown/"), below("hidden/")
REFUSED = "a holds more than one archive in one file"


def tar_of(path: Path, files: dict[str, str], mode: str = "w") -> Path:
    return tarred(path, [(member(name), text.encode()) for name, text in files.items()], mode)


@pytest.fixture
def one(tmp_path: Path) -> bytes:
    return zipped(tmp_path / "one.zip", SHOWN).read_bytes()


@pytest.fixture
def two(tmp_path: Path) -> bytes:
    return zipped(tmp_path / "two.zip", HIDDEN).read_bytes()


def test_a_zip_behind_a_zip(tmp_path: Path, into: Path, one: bytes, two: bytes):
    """Python and unzip show the last, others the first."""
    (tmp_path / "a").write_bytes(one + two)
    assert REFUSED in refusal(tmp_path / "a", into)


def test_a_zip_in_the_comment_of_a_zip(tmp_path: Path, into: Path, one: bytes, two: bytes):
    (tmp_path / "a").write_bytes(one[:-2] + len(two).to_bytes(2, "little") + two)
    assert REFUSED in refusal(tmp_path / "a", into)


@pytest.mark.parametrize("place", ["between the entries", "before the directory"])
def test_entries_that_the_directory_does_not_list(tmp_path: Path, into: Path, two: bytes, place: str):
    with zipfile.ZipFile(tmp_path / "a", "w") as archive:
        names = list(SHOWN)
        for name in names:
            archive.writestr(name, SHOWN[name])
            if name == (names[2] if place == "between the entries" else names[-1]):
                archive.fp.write(two)
                archive.start_dir += len(two)
    assert REFUSED in refusal(tmp_path / "a", into)


@pytest.mark.parametrize("pack", [bytes, gzip.compress, bz2.compress, lzma.compress], ids=["tar", "gz", "bz2", "xz"])
def test_a_tar_behind_a_tar(tmp_path: Path, into: Path, pack: Callable[[bytes], bytes]):
    first, second = (tar_of(tmp_path / n, files).read_bytes() for n, files in (("1", SHOWN), ("2", HIDDEN)))
    (tmp_path / "a").write_bytes(pack(first) + pack(second))
    assert REFUSED in refusal(tmp_path / "a", into)


@pytest.mark.parametrize("mode", ["w", "w:gz", "w:bz2", "w:xz"])
def test_a_zip_behind_a_tar(tmp_path: Path, into: Path, two: bytes, mode: str):
    source = tar_of(tmp_path / "a", SHOWN, mode)
    source.write_bytes(source.read_bytes() + two)
    assert REFUSED in refusal(source, into)


def test_a_file_that_is_both_a_tar_and_a_zip(tmp_path: Path, into: Path, two: bytes):
    """The tar's first member has a name that begins like a zip, and another holds one."""
    members = [(member("PK\x03\x04"), b""), *((member(n), t.encode()) for n, t in SHOWN.items()), (member("z"), two)]
    assert REFUSED in refusal(tarred(tmp_path / "a", members, "w"), into)


# -- honest archives that look a little alike -----------------------------------------------------------------------


def test_a_compressed_tar_in_several_streams_is_read_whole(tmp_path: Path, into: Path):
    """As pbzip2 and pigz write them."""
    plain = tar_of(tmp_path / "plain.tar", SHOWN).read_bytes()
    packs: tuple[Callable[[bytes], bytes], ...] = (gzip.compress, bz2.compress, lzma.compress)
    for number, pack in enumerate(packs):
        source = tmp_path / f"a{number}"
        source.write_bytes(b"".join(pack(plain[at : at + 1000]) for at in range(0, len(plain), 1000)))
        assert open_submission(source, into / str(number), COURSE).intake.files == sorted(SHOWN)


def test_zero_bytes_behind_an_archive_are_padding(tmp_path: Path, into: Path):
    for mode in ("w", "w:gz", "w:bz2", "w:xz"):
        source = tar_of(tmp_path / "a", SHOWN, mode)
        source.write_bytes(source.read_bytes() + bytes(512))
        assert open_submission(source, into / mode[2:], COURSE).intake.files == sorted(SHOWN)


def test_a_zip_that_holds_a_zip_and_was_appended_to_is_one_archive(tmp_path: Path, into: Path, two: bytes):
    with zipfile.ZipFile(tmp_path / "a", "w") as archive:
        archive.writestr("inner.zip", two)
        archive.writestr("noise", random.Random(1).randbytes(50_000))
    with zipfile.ZipFile(tmp_path / "a", "a", zipfile.ZIP_DEFLATED) as archive:
        for name, text in SHOWN.items():
            with archive.open(name, "w", force_zip64=True) as file:
                file.write(text.encode())
    assert open_submission(tmp_path / "a", into, COURSE).intake.package_path == "shown"


def test_a_zip_written_to_a_pipe_is_one_archive(tmp_path: Path, into: Path):
    """Its sizes follow the data of each entry."""

    class Pipe:
        def __init__(self, file):
            self.write, self.flush = file.write, file.flush

    with (
        (tmp_path / "a").open("wb") as file,
        zipfile.ZipFile(cast("IO[bytes]", Pipe(file)), "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name, text in SHOWN.items():
            archive.writestr(name, text)
    assert open_submission(tmp_path / "a", into, COURSE).intake.files == sorted(SHOWN)
