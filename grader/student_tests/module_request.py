"""What a worker is asked to do: one run of pytest over a module of the package's own tests."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class ModuleRequest:
    """One run of pytest over one module. Paths in `files` are those in the sandbox; `beside` are further modules.

    `select` names the tests to run, in this order; without it all run in the module's own order. Limits are seconds
    of wall time: `limits` for single tests, `limit` for each other test and for collecting, `total` for the whole run.
    """

    module: str
    files: Mapping[str, str] = field(default_factory=dict)
    beside: Sequence[str] = ()
    select: Sequence[str] = ()
    first_failure: bool = False
    coverage: bool = False
    limits: Mapping[str, float] = field(default_factory=dict)
    limit: float = 60.0
    total: float = 90.0

    def to_json(self) -> str:
        """Return the request as the worker reads it: all but the files, which are part of the tree under test."""
        return json.dumps({
            "modules": [self.module, *self.beside], "order": list(self.select),
            "first": self.first_failure, "coverage": self.coverage, "limits": dict(self.limits),
            "limit": self.limit, "total": self.total,
        })  # fmt: skip
