"""What can be told of a Python file that cannot be read: the definitions that its lines begin with."""

from __future__ import annotations

import re
from collections.abc import Iterator

from grader.evidence import Definition
from grader.quality.definitions import is_judged

_DEFINITION = re.compile(rb"[ \t]*(?:async[ \t]+)?(def|class)[ \t]+([A-Za-z]\w*)")
_KINDS = {b"def": "function", b"class": "class"}
_UNSEEN = "the file cannot be read"


def definitions(path: str, data: bytes) -> Iterator[Definition]:
    """Yield the module and what is public in it as far as can be told, all without docstrings and annotations."""
    if not is_judged(path):
        return
    yield Definition(path, 1, "module", path, documented=False)
    for number, line in enumerate(data.splitlines(), 1):
        match = _DEFINITION.match(line)
        if match:
            kind, name = _KINDS[match[1]], match[2][:200].decode("ascii")
            missing = [_UNSEEN] if kind == "function" else []
            yield Definition(path, number, kind, name, documented=False, unannotated=missing)
