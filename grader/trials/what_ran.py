"""What ran of a package in a node's processes, as they note it themselves: where the notes lie, and what they mean.

The node's own Python writes them (in_node/sitecustomize.py) into a pipe that nothing in the sandbox can read. What it
holds is untrusted: a submission may write there, too.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath

from grader import building, sandbox
from grader.evidence import Flag, Ran, Trial
from grader.host import namespaces, ros_env
from grader.quality.source_files import PythonFile
from grader.sandbox import untrusted
from grader.sanitize import printable

_AT_START = Path(__file__).with_name("in_node")
_PIPE_BYTES = 1024 * 1024
_MOST_FUNCTIONS, _MOST_UNSEEN = 10_000, 50
_TYPE_FOLDERS = ("msg", "srv", "action")
_SHEBANG = re.compile(rb"#![^\n]*\n?")
_ENTRY_SCRIPT = re.compile(r"# EASY-INSTALL-ENTRY-SCRIPT: ('[\w.=+!-]+'),'console_scripts',('[\w.-]+')\n")
# The SHA-256 of what setuptools 79 writes for an entry point, without the first line and the two names.
_ENTRY_SCRIPT_DIGEST = "18eb4eac508fcd1d7564cb8d5f05df5c3ccf64c0bfd1ae70a3a989821894c308"
# Where a sandbox has files that are neither the system's nor the grader's. libffi maps its own closures from memory.
_BROUGHT = re.compile(r"/(ws/(?!ros2/|at_start/|first/|launch/)|tmp/|home/|run/|dev/shm/|memfd:(?!libffi))")
_OF_TYPES = re.compile(
    rf"lib/lib\w+__rosidl_(generator|typesupport)(_fastrtps|_introspection)?_(c|cpp|py)\.so|{ros_env.SITE_IN_PREFIX}/"
    r"(\w+)/\4_s__rosidl_typesupport_(fastrtps_|introspection_)?c(\.[\w-]+)?\.so"
)
_PYTHON = re.compile(r"(^|/)(lib)?python3?[\d.]*(\.so[\d.]*)?$")
_OPTIONS = re.compile(r"((-[WX] ?\S+|-[bBcdEiIOPqsSuvx]+) )*")
_CONCERNS = ("what ran", "student tests", "mutation")
_WORDS = {
    "code made at run time": "code ran that was made at run time, or lies where nobody has handed it in",
    "byte code": "code ran from byte code that has no text",
    "archive": "code ran from an archive",
    "library": "compiled code ran that the package brought along",
    "notes turned off": "what ran was kept from being noted",
}
"""What each kind of unseen code is."""


class Notes:
    """The pipe into which the processes of a trial write what runs, of one trial after another. Close it at the end.

    A Python that starts before the first trial begins finds a pipe into which it cannot write, and notes nothing.

    Args:
        parent: a folder, for a new one in it. Its path can be read in the sandbox, so it does not name the trial.
    """

    def __init__(self, parent: Path) -> None:
        folder = Path(tempfile.mkdtemp(prefix="ran-", dir=parent))
        folder.chmod(0o755)
        self.pipe = folder / "pipe"
        """Where it is on the host."""
        os.mkfifo(self.pipe)
        self._read_end = os.open(self.pipe, os.O_RDONLY | os.O_NONBLOCK)
        self.pipe.chmod(0)
        with contextlib.suppress(OSError):  # of a user with many large pipes: it holds 64 KB, and no note beyond
            fcntl.fcntl(self._read_end, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
        self.functions = False
        self._outside: list[str] = []
        self._if_functions = folder / "functions"
        self.mounts = {folder: "/ws/ran", _AT_START: str(sandbox.AT_START)}
        """What the sandbox has to show, and where."""

    def begin(self, *, functions: bool) -> None:
        """Begin with a trial; `functions` is whether each function that runs is noted."""
        self.functions, self._outside = functions, []
        self.pipe.chmod(0o222)
        self._if_functions.touch() if functions else self._if_functions.unlink(missing_ok=True)
        while self._chunk():
            pass

    def close(self) -> None:
        """Close the pipe."""
        os.close(self._read_end)

    def look_at(self, processes: Iterable[int]) -> None:
        """Note what /proc shows of the node's processes: what their own Python cannot see, or keeps to itself."""
        if not namespaces.refusal():  # a sandbox without them has other paths
            self._outside += [words for pid in processes for words in unseen_of_process(Path("/proc", str(pid)))]

    def read(self, node_is_up: bool) -> Ran | None:
        """Return what has been noted, by installed paths; None if that is nothing that the trial was to note."""
        data = b""
        while chunk := self._chunk():
            data += chunk
        lines = [line.split("\t") for line in data.decode("utf-8", "replace").splitlines()]
        if node_is_up and (["start"] not in lines or len(data) >= _PIPE_BYTES):
            if namespaces.refusal():  # a sandbox without them may show another pipe
                return None
            words = "notes turned off: the node's program has noted nothing"
            return Ran(unseen=list(dict.fromkeys([words, *self._outside])), of_functions=False)
        ran = _ran(lines)
        told = any(words.startswith("notes turned off") for words in ran.unseen)  # it has said who did that
        further = [words for words in self._outside if not (told and words.startswith("notes turned off"))]
        ran = replace(ran, unseen=list(dict.fromkeys([*ran.unseen, *further]))[:_MOST_UNSEEN])
        if self.functions and node_is_up:
            return ran
        return Ran(unseen=ran.unseen, of_functions=False) if ran.unseen else None

    def _chunk(self) -> bytes:
        try:
            return os.read(self._read_end, 65536)
        except BlockingIOError:  # nothing more, from a process that still runs
            return b""


def unseen_of_process(process: Path) -> list[str]:
    """Return what a process's folder in /proc shows of code that its Python notes nothing of, as "kind: what".

    That is a library or a program that the package brought along, however it was loaded, and a Python that was started
    so that it notes nothing. What rosidl makes for a package's types is no code of the package.
    """
    try:
        mapped = {" ".join(words[5:]) for line in (process / "maps").read_text("utf-8", "replace").splitlines()
                  if len(words := line.split()) > 5 and "x" in words[1]}  # fmt: skip
        command, variables = (
            (process / name).read_bytes().rstrip(b"\0").split(b"\0") for name in ("cmdline", "environ")
        )
    except OSError:  # it has just ended, or may not be read by an ordinary user
        return []
    known = tuple(f"{path}/" for prefix in ros_env.PREFIXES for path in (prefix, prefix.resolve()))
    brought = [file for file in mapped if _BROUGHT.match(file) and not file.startswith(known)]
    files = sorted(_relative(file.removesuffix(" (deleted)")) for file in brought)
    found = [f"library: {printable(file)}" for file in files if not _OF_TYPES.fullmatch(file)]
    if any(_PYTHON.search(file) for file in mapped):
        words = [os.fsdecode(word) for word in command]
        start = next((n for n, word in enumerate(words) if _PYTHON.search(word)), 0)
        options = _OPTIONS.match(" ".join([*words[start + 1 :], ""]))
        path = next((each for each in variables if each.startswith(b"PYTHONPATH=")), b"")
        if options and set(re.sub(r"-[WX] ?\S+", "", options[0])) & set("IES"):
            found.append(f"notes turned off: {printable(' '.join(words[: start + 4]))[:300]}")
        elif os.fsencode(sandbox.AT_START) not in path:
            found.append("notes turned off: a Python without PYTHONPATH")
    return found


def _ran(lines: Sequence[Sequence[str]]) -> Ran:
    functions: dict[str, set[int]] = {}
    unseen: list[str] = []
    for kind, *rest in lines:
        if kind == "unseen" and len(rest) == 3 and rest[0] in _WORDS:
            what, by = (printable(_relative(part)) for part in rest[1:])
            unseen.append(f"{rest[0]}: {what}" + (f", by {by}" if by else ""))
        elif kind in ("import", "call") and rest and re.fullmatch(rf"{building.INSTALL}/[^\0]+", rest[0]):
            found = functions.setdefault(_relative(rest[0]), set())
            if kind == "call" and len(rest) == 2 and rest[1].isdecimal() and len(found) < _MOST_FUNCTIONS:
                found.add(int(rest[1][:9]))
    unseen = list(dict.fromkeys(unseen))[:_MOST_UNSEEN]
    return Ran({path: sorted(found) for path, found in sorted(functions.items())}, unseen)


def _relative(path: str) -> str:
    return path.removeprefix(f"{building.INSTALL}/")


@dataclass(frozen=True)
class Places:
    """Which file of a package each installed one is: its path in the package, by its installed path.

    `left` are those that were not handed in, but made by the build: installed paths by their paths in the package.
    """

    paths: dict[str, str] = field(default_factory=dict)
    left: dict[str, str] = field(default_factory=dict)


def places(trials: Mapping[str, Trial], handed_in: Sequence[PythonFile], install: Path) -> Places:
    """Return the places of all installed files of which something ran in any trial.

    A file is the one handed in that has its content. Left out are the modules that rosidl makes, and the programs that
    setuptools writes for entry points; a file of the build's own counts only if a function of it ran.
    """
    noted: dict[str, bool] = {}
    for trial in trials.values():
        for path, functions in trial.ran.functions.items() if trial.ran else ():
            noted[path] = noted.get(path, False) or bool(functions)
        for words in trial.ran.unseen if trial.ran else ():
            if by := _made_by(words):
                noted.setdefault(by, False)
    texts: dict[bytes, list[str]] = {}
    for source in handed_in:
        texts.setdefault(_text(source.data), []).append(source.path)
    found = Places()
    for path, calls in noted.items():
        file = (install / path).resolve()  # of the build's links, those that lead out of the tree have been removed
        data = untrusted.read_bytes(file) if file.is_relative_to(install.resolve()) else None
        inside = _path_in_package(path)
        if data is None or _is_of_types(path) or _starts_an_entry_point(data):
            continue
        if same := texts.get(_text(data)):
            found.paths[path] = max(same, key=lambda each: (_common_end(each, inside), each))
        elif calls:
            found.paths[path] = inside
            found.left[inside] = path
    return found


def in_package(trial: Trial, found: Places) -> Trial:
    """Return the trial with what ran by paths in the package."""
    if trial.ran is None:
        return trial
    functions: dict[str, set[int]] = {}
    for path, lines in trial.ran.functions.items():
        if path in found.paths:
            functions.setdefault(found.paths[path], set()).update(lines)
    made = [(words, _made_by(words)) for words in trial.ran.unseen]
    unseen = [words.replace(f", by {by}:", f", by {found.paths.get(by, by)}:") for words, by in made]
    known = {path: sorted(lines) for path, lines in sorted(functions.items())}
    return replace(trial, ran=replace(trial.ran, functions=known, unseen=unseen))


def unseen_flags(trial: Trial) -> Iterator[Flag]:
    """Yield a flag for all code that ran in a trial and lies in no file that can be read."""
    for words in trial.ran.unseen if trial.ran else ():
        kind, _, rest = words.partition(": ")
        code, known, by = rest.rpartition(", by ")
        code = code if known else rest
        # Text that runs has no file but that of the code which runs it.
        where = code if kind in ("archive", "byte code", "library") else _made_by(words) or trial.node
        what = f"{_WORDS[kind]}: {code}{f', at {by}' if known else ''}"
        yield Flag(kind, what, where=where, concerns=list(_CONCERNS))


def _made_by(words: str) -> str:
    """Return the file whose code made unseen code run, "" if that is not known."""
    _, known, by = words.rpartition(", by ")
    return by.rpartition(":")[0] if known else ""


def _path_in_package(path: str) -> str:
    """Return the path that an installed file would have in the package: below site-packages or share/<package>."""
    site, parts = ros_env.SITE_IN_PREFIX.parts, PurePosixPath(path).parts
    inside = parts[len(site) :] if parts[: len(site)] == site else parts[2:] if parts[0] == "share" else parts
    return "/".join(inside or parts)


def _common_end(one: str, other: str) -> int:
    """Return how many parts two paths have in common, from their ends on."""
    pairs = zip(reversed(PurePosixPath(one).parts), reversed(PurePosixPath(other).parts), strict=False)
    return next((count for count, (a, b) in enumerate(pairs) if a != b), min(one.count("/"), other.count("/")) + 1)


def _is_of_types(path: str) -> bool:
    """Return whether a path is where rosidl puts a package's types."""
    site, parts = ros_env.SITE_IN_PREFIX.parts, PurePosixPath(path).parts
    return parts[: len(site)] == site and len(parts) > len(site) + 2 and parts[len(site) + 1] in _TYPE_FOLDERS


def _text(data: bytes) -> bytes:
    """Return a program without the line that names its interpreter, which setuptools changes."""
    return _SHEBANG.sub(b"", data, count=1).strip()


def _starts_an_entry_point(data: bytes) -> bool:
    """Return whether a program is the one that setuptools writes for an entry point, letter by letter."""
    text = _SHEBANG.sub(b"", data, count=1).decode("utf-8", "replace")
    match = _ENTRY_SCRIPT.match(text)
    if match is None:
        return False
    without_names = text.replace(match.group(1), "''").replace(match.group(2), "''")
    return hashlib.sha256(without_names.encode()).hexdigest() == _ENTRY_SCRIPT_DIGEST
