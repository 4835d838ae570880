"""The tree that a run of tests finds: the package as handed in, with the files that the request changes.

The host keeps it and hands it in anew for each run, so that no process in the sandbox holds anything else of it.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from grader.sandbox import untrusted

_AT_MOST = 20_000_000  # bytes; the rest of a larger package (maps, bags) is not restored before each run
_PLAIN = 0o644


class Tree:
    """The files of a package as they were handed in, by their paths in the sandbox, and the byte code made of them.

    Args:
        package: the package's source folder, of which no test has run yet.
        modules: the folder of its installed modules. Of this one only Python files are restored.
        inside: where the two are in the sandbox.
    """

    def __init__(self, package: Path, modules: Path, inside: tuple[Path, Path]) -> None:
        self._files: dict[str, tuple[str, tuple[int, int], int]] = {}
        self._others: list[str] = []
        self._byte_code: dict[str, tuple[str, str] | None] = {}
        room = _AT_MOST
        for folder, root in zip((package, modules), inside, strict=True):
            for path in sorted(folder.rglob("*"), key=lambda path: (path.suffix != ".py", path)):
                name, facts = str(root / path.relative_to(folder)), path.lstat()
                is_wanted = folder == package or path.suffix == ".py"
                data = untrusted.read_bytes(path, room) if is_wanted else None
                if data is None:
                    self._others.append(name)
                    continue
                room -= len(data)
                self._files[name] = _as_text(data), (facts.st_atime_ns, facts.st_mtime_ns), facts.st_mode & 0o7777

    def under_test(self, changed: Mapping[str, str]) -> str:
        """Return the tree with the texts `changed`, as the worker reads it.

        The times of a changed file are those of the original, and byte code of the original is left out.
        """
        files = dict(self._files)
        some_times = next((times for _, times, _ in files.values()), (0, 0))
        for name, text in changed.items():
            _, times, mode = files.get(name, ("", some_times, _PLAIN))
            files[name] = _as_text(text.encode("utf-8", "surrogateescape")), times, mode
        compiled = {source: made for source, made in self._byte_code.items() if source not in changed}
        files |= {made[0]: (made[1], files[source][1], _PLAIN) for source, made in compiled.items() if made}
        return json.dumps({"files": files, "others": self._others, "compiled": list(compiled)})

    def keep_byte_code(self, made: Any, changed: Mapping[str, str]) -> None:
        """Keep what the worker has compiled before a run: {source: [path, bytes]}, None where that cannot be done."""
        for source, code in made.items() if isinstance(made, dict) else ():
            if source in self._files and source not in changed:
                is_code = isinstance(code, list) and len(code) == 2 and all(isinstance(part, str) for part in code)
                self._byte_code[source] = tuple(code) if is_code else None


def _as_text(data: bytes) -> str:
    return base64.b64encode(data).decode()
