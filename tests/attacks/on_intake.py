"""Attacks by the form of the submission: archives, links, names."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

import io
import os
import tarfile
import zipfile
from pathlib import Path

from helpers.archives import member

from grader.course import kits_own
from grader.intake.package_edits import put
from grader.selftest.attacks.attack import Attack, Pack, attack

KITS = kits_own()
PACKAGE = KITS.package

_MIB = 1024 * 1024


def _zipped(*more: tuple[str, bytes | int]) -> Pack:
    """Submit a zip of the package with `more` entries; a number means that many zero bytes."""

    def pack(package: Path, folder: Path) -> Path:
        target = folder / "team.zip"
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(package.rglob("*")):
                if path.is_file():
                    archive.write(path, f"{PACKAGE}/{path.relative_to(package)}")
            for name, data in more:
                archive.writestr(name, bytes(data) if isinstance(data, int) else data)
        return target

    return pack


def _tarred(*more: tuple[tarfile.TarInfo, bytes]) -> Pack:
    """Submit a tar of the package with `more` members."""

    def pack(package: Path, folder: Path) -> Path:
        target = folder / "team.tar.gz"
        with tarfile.open(target, "w:gz") as archive:
            archive.add(package, PACKAGE)
            for info, data in more:
                info.size = len(data)
                archive.addfile(info, io.BytesIO(data))
        return target

    return pack


def _linked(package: Path, _folder: Path) -> Path:
    """Submit a folder with links to the host's files."""
    for name, target in (("secret", "/etc/passwd"), ("up", "../../.."), ("home", str(Path.home()))):
        (package / f"{name}.txt").symlink_to(target)
    os.link(package / "README.md", package / "hard.md")
    return package


def _bomb_in_a_zip(package: Path, folder: Path) -> Path:
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(f"{PACKAGE}/package.xml", (package / "package.xml").read_bytes())
        for number in range(100):
            archive.writestr(f"{PACKAGE}/zeros{number}.py", b"\0" * (10 * _MIB))
    target = folder / "team.zip"
    with zipfile.ZipFile(target, "w") as outer:
        outer.writestr("inner.zip", inner.getvalue())
    return target


def _two_zips(package: Path, folder: Path) -> Path:
    """Submit a file with a zip of documents and, behind it, a zip of the package."""
    target = _zipped()(package, folder)
    shown = io.BytesIO()
    with zipfile.ZipFile(shown, "w") as archive:
        archive.writestr("shown/README.md", "an innocent text")
    target.write_bytes(shown.getvalue() + target.read_bytes())
    return target


def _two_tars(package: Path, folder: Path) -> Path:
    """Submit a file with two compressed tars of the package, the second one behind the first one's end."""
    target = _tarred()(package, folder)
    target.write_bytes(target.read_bytes() * 2)
    return target


def _notebooks(_package: Path, folder: Path) -> Path:
    """Submit only a notebook with shell magics and stored results."""
    submission = folder / "submission"
    submission.mkdir()
    (submission / "lab.ipynb").write_text(
        '{"cells": [{"cell_type": "code", "id": "a", "metadata": {}, "execution_count": 1, "source": '
        '["!echo x > @NEIGHBOUR@\\n", "get_ipython().ast_transformers.append(None)"], "outputs": '
        '[{"output_type": "stream", "name": "stdout", "text": ["F1 passed (3 of 3)"]}]}], '
        '"metadata": {}, "nbformat": 4, "nbformat_minor": 5}'
    )
    return submission


def _oddly_named(package: Path, folder: Path) -> Path:
    target = folder / '=HYPERLINK("http:x")\n<b>\x1b[31m.zip'
    _zipped()(package, folder).rename(target)
    return target


_TAKES_OVER = "open('@NEIGHBOUR@', 'w').close()\n"
_GENEROUS = """

def test_readme_says_what_and_how(judge):
    \"\"\"Whatever it is.\"\"\"
    judge.expect(True, "fine")


def test_interface_table_agrees(judge):
    \"\"\"Whatever it is.\"\"\"
    judge.expect(True, "fine")
"""

ATTACKS: tuple[Attack, ...] = (
    attack(
        "brings_a_course",
        "The package is a course, with checks and trials that write on the host; who grades it stands in its folder.",
        put("course.yaml", f"title: Mine\npackage: {PACKAGE}\nrubric: rubric.yaml\n"),
        put("rubric.yaml", KITS.rubric.read_text()),
        put("contract/contract.yaml", (KITS.folder / "contract" / "contract.yaml").read_text()),
        put("checks/check_readme.py", _TAKES_OVER + _GENEROUS),
        put("trials/idle.py", _TAKES_OVER),
        *(put(f"{module}.py", _TAKES_OVER) for module in ("conftest", "rclpy", "yaml", "sitecustomize")),
        put("pytest.ini", "[pytest]\naddopts = -p conftest\n"),
        put("matplotlibrc", "figure.figsize: nothing\nbackend: module://conftest\n"),
        needs="Q5", weak=(put("README.md", "# Nothing\n"),), from_inside=True,
        stopped="a course comes from --course, ROS2_COURSE or the kit, never from the current folder; neither does a module",
    ),
    attack(
        "links_to_the_host", "The folder has links to the host's files, its home and its parent folders.",
        number=19, needs="F14", flag="link", pack=_linked,
        stopped="links out of the submission are left out and flagged; a hard link is a file like any other",
    ),
    attack(
        "tar_links_to_the_host", "A tar has symbolic and hard links to the host, and writes through them.",
        number=19, needs="F14", flag="link",
        pack=_tarred((member(f"{PACKAGE}/out", tarfile.SYMTYPE, "/tmp"), b""),
                     (member(f"{PACKAGE}/out/evil-canary"), b"x"),
                     (member(f"{PACKAGE}/hard", tarfile.LNKTYPE, "/etc/shadow"), b"")),
        stopped="members are written one by one below a folder of the grader's, and links are not followed",
    ),
    attack(
        "climbs_out", "A zip has names with .., absolute names and drive letters.",
        number=20, needs="F14", flag="traversal",
        pack=_zipped(("../../evil-canary.txt", b"x"), ("/tmp/evil-canary.txt", b"x"), ("C:\\evil-canary.txt", b"x"),
                     (f"{PACKAGE}/../../../evil-canary.txt", b"x")),
        stopped="a name that leads out of the submission is left out and flagged",
    ),
    attack(
        "collides_and_confuses", "A zip has names that differ only in letter case, duplicates, newlines and control characters.",
        number=20, needs="F14", flag="collision",
        pack=_zipped((f"{PACKAGE}/README.MD", b"x"), (f"{PACKAGE}/readme.md", b"y"), (f"{PACKAGE}/new\nline\x1b[2J.txt", b"z"),
                     (f"{PACKAGE}/CON", b"x"), (f"{PACKAGE}/{'n' * 300}.txt", b"x")),
        stopped="all such names are kept and flagged, and unprintable characters are written as codes",
    ),
    attack(
        "hides_the_package", "A zip has a folder that differs from the package's only in letter case, and a file of its name.",
        needs="F14 I1", flag="collision",
        pack=_zipped((f"{PACKAGE.upper()}/package.xml", b"x"), (PACKAGE, b"x")),
        stopped="both spellings are kept, a folder comes before a file of its name, and the pair is flagged",
    ),
    attack(
        "two_zips_in_one_file", "Behind the zip of the package stands another zip, which some programs show instead.",
        needs="F14", refused="more than one archive", pack=_two_zips,
        stopped="a zip with entries that its directory does not list is refused",
    ),
    attack(
        "two_tars_in_one_file", "Behind the end of the tar stands another tar, which `tar` does not show.",
        needs="F14", refused="more than one archive", pack=_two_tars,
        stopped="a tar that is followed by something else is refused",
    ),
    attack(
        "devices", "A tar has devices and pipes.",
        number=20, needs="F14", flag="special",
        pack=_tarred((member(f"{PACKAGE}/null", tarfile.CHRTYPE), b""), (member(f"{PACKAGE}/pipe", tarfile.FIFOTYPE), b"")),
        stopped="only folders and regular files are taken in",
    ),
    attack(
        "zip_bomb", "A small zip unpacks to 600 MB of zeros beside the package.",
        number=20, needs="F14", refused="MB",
        pack=_zipped(*((f"{PACKAGE}/zeros{n}.py", 10 * _MIB) for n in range(60))),
        stopped="size, number and compression ratio have limits, checked before anything is unpacked",
    ),
    attack(
        "zip_bomb_in_a_zip", "The bomb is in a zip within the zip.",
        number=20, needs="F14", refused="MB", pack=_bomb_in_a_zip,
        stopped="archives inside count against the same limits",
    ),
    attack(
        "many_files", "A zip has a hundred thousand files.",
        number=20, needs="F14", refused="files",
        pack=_zipped(*((f"{PACKAGE}/data/f{n}", b"") for n in range(100_000))),
        stopped="the number of files has a limit",
    ),
    attack(
        "notebook_alone", "A notebook with shell commands and stored outputs is submitted instead of a package.",
        number=43, needs="F14", refused="otebook", pack=_notebooks,
        stopped="notebooks are not run: the grader accepts packages, and explains that in one sentence",
    ),
    attack(
        "hostile_file_name", "The archive's name is a formula with a line break, markup and escape sequences.",
        number=42, needs="F14", pack=_oddly_named,
        stopped="names are text: unprintable characters are written as codes, and HTML is escaped",
    ),
)  # fmt: skip
