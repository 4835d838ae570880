"""Any input gives a Submission or a SubmissionError, and writes nothing outside its folder."""

from __future__ import annotations

import contextlib
import io
import os
import random
import stat
import tarfile
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

from helpers.archives import below, member, tarred, zipped
from helpers.course import COURSE
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grader.errors import SubmissionError
from grader.intake.submission import Submission, open_submission

NAMES = st.lists(
    st.sampled_from(["..", ".", "a", "A", "src", "package.xml", "robot_controller.py", "CMakeLists.txt", "pyvenv.cfg"])
    | st.sampled_from(
        ["COLCON_IGNORE", "share", "build", "x.zip", "\x00", "\n", "é", "e\u0301", "\ud800", "~", "C:", "n" * 260]
    )
    | st.text(max_size=6),
    min_size=1,
    max_size=5,
).map("/".join) | st.sampled_from(["/etc/passwd", "..\\..\\x", "a//b", "./a", "/", ""])
CONTENTS = st.binary(max_size=60) | st.sampled_from(
    [b"<package><name>a</name></package>", b"import rclpy\n", b"PK\x05\x06" + bytes(18)]
)
KINDS = st.sampled_from([
    tarfile.REGTYPE, tarfile.REGTYPE, tarfile.DIRTYPE, tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE,
    tarfile.FIFOTYPE, b"S", b"x", b"L",
])  # fmt: skip
PARTS = st.lists(
    st.sampled_from(["a", "A", "src", "package.xml", "\n", "é", "build", "%0A", "\\"]), min_size=1, max_size=4
)
ENTRIES = st.lists(st.tuples(NAMES, KINDS, NAMES, CONTENTS), max_size=8)


def as_zip(path: Path, entries: list[tuple[str, bytes, str, bytes]]) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name, kind, target, data in entries:
            info = zipfile.ZipInfo(name.encode("utf-8", "replace").decode() or "x")
            modes = {tarfile.SYMTYPE: stat.S_IFLNK, tarfile.CHRTYPE: stat.S_IFCHR, tarfile.FIFOTYPE: stat.S_IFIFO}
            info.external_attr = (modes.get(kind, stat.S_IFREG) | 0o4755) << 16
            archive.writestr(info, os.fsencode(target.replace("\ud800", "")) if kind == tarfile.SYMTYPE else data)


def as_tar(path: Path, entries: list[tuple[str, bytes, str, bytes]]) -> None:
    with tarfile.open(path, "w", format=tarfile.GNU_FORMAT, errors="replace") as archive:
        for name, kind, target, data in entries:
            info = member(name.replace("\x00", ""), kind, target.replace("\x00", ""), 0o4755)
            info.size = len(data) if kind in (tarfile.REGTYPE, b"S", b"x", b"L") else 0
            archive.addfile(info, io.BytesIO(data))


def check_any(make: Callable[[Path], object]) -> Submission | None:
    """Open what `make` writes; check that only the two permitted outcomes occur, and nothing outside `into`."""
    with tempfile.TemporaryDirectory() as folder:
        tmp = Path(folder)
        source, into = tmp / "source", tmp / "deep" / "er" / "into"
        into.parent.mkdir(parents=True)
        make(source)
        before = sorted(tmp.rglob("*"))
        opened, message = None, ""
        try:
            opened = open_submission(source, into, COURSE)
        except SubmissionError as refused:
            message = str(refused)
        assert [path for path in sorted(tmp.rglob("*")) if not path.is_relative_to(into)] == before
        if opened is None:
            assert message.isprintable()
            return None
        for path in into.rglob("*"):
            mode = path.lstat().st_mode
            assert stat.S_ISREG(mode) or stat.S_ISDIR(mode)
            assert not mode & (stat.S_ISUID | stat.S_ISGID)
        assert opened.package.is_relative_to(into)
        assert opened.package.is_dir()
        assert all(text.isprintable() for text in [*opened.intake.files, *opened.intake.notes, *opened.intake.others])
        return opened


ANY = settings(max_examples=80, suppress_health_check=[HealthCheck.too_slow])


@given(ENTRIES)
@ANY
def test_any_zip_gives_a_submission_or_a_sentence(entries: list[tuple[str, bytes, str, bytes]]):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # by zipfile, for duplicate names
        check_any(lambda path: as_zip(path, entries))


@given(ENTRIES)
@ANY
def test_any_tar_gives_a_submission_or_a_sentence(entries: list[tuple[str, bytes, str, bytes]]):
    check_any(lambda path: as_tar(path, entries))


@given(st.integers(0, 10_000), st.sampled_from(["zip", "tar", "tar.gz", "tar.bz2", "tar.xz"]))
@ANY
def test_a_damaged_archive_gives_a_submission_or_a_sentence(seed: int, form: str):
    """Change bytes of an intact archive, and sometimes truncate it."""
    rng = random.Random(seed)

    def make(path: Path) -> None:
        whole = bytearray(INTACT[form])
        for _ in range(rng.randint(1, 8)):
            whole[rng.randrange(len(whole))] = rng.choice((0, 255, 0x80, rng.randrange(256)))
        path.write_bytes(whole[: rng.choice((len(whole), rng.randrange(1, len(whole))))])

    check_any(make)


@given(st.binary(max_size=400), st.sampled_from([b"PK\x03\x04", b"\x1f\x8b\x08", b"BZh9", b"\xfd7zXZ\x00", b""]))
@ANY
def test_any_bytes_give_a_sentence(data: bytes, magic: bytes):
    assert check_any(lambda path: path.write_bytes(magic + data)) is None


@given(st.lists(st.tuples(PARTS, st.sampled_from(["file", "link", "pipe"])), max_size=8))
@ANY
def test_any_folder_gives_a_submission_or_a_sentence(entries: list[tuple[list[str], str]]):
    def make(path: Path) -> None:
        path.mkdir()
        for parts, kind in entries:
            place = path.joinpath(*parts)
            with contextlib.suppress(OSError):  # there is a file of that name
                place.parent.mkdir(parents=True, exist_ok=True)
                if kind == "file":
                    place.touch()
                elif kind == "link":
                    place.symlink_to("/etc")
                else:
                    os.mkfifo(place)

    check_any(make)


def _intact() -> dict[str, bytes]:
    members = [(member(name), text.encode()) for name, text in below("pkg/").items()]
    with tempfile.TemporaryDirectory() as folder:
        made = {"zip": zipped(Path(folder, "a"), below("pkg/")).read_bytes()}
        for form, mode in {"tar": "w", "tar.gz": "w:gz", "tar.bz2": "w:bz2", "tar.xz": "w:xz"}.items():
            made[form] = tarred(Path(folder, "a"), members, mode).read_bytes()
    return made


INTACT = _intact()
