"""What ROS's own tools make of interface definitions: their type hashes, and their Python modules.

The files that a build installs for an interface come from the submission's build, which can write anything. So the
grader makes them once more itself, in a sandbox that runs nothing of the submission (`worker.py`).
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from grader import sandbox
from grader.host import ros_env
from grader.processes.kept import Kept
from grader.sandbox import untrusted

_WORKER = Path(__file__).with_name("worker.py")
_MAX_BYTES = 100_000
_MAX_FILES = 200
_SUFFIXES = (".msg", ".srv", ".action")


@dataclass(frozen=True)
class Generated:
    """What ROS's tools make of a package's definitions.

    Attributes:
        hashes: the RIHS01 hash of each interface, by its name "srv/SetSpeed".
        modules: the SHA-256 of each Python module, by its path "srv/_set_speed.py" in the Python package.
        exports: the text of each `__init__.py`, by its path.
    """

    hashes: dict[str, str] = field(default_factory=dict)
    modules: dict[str, str] = field(default_factory=dict)
    exports: dict[str, str] = field(default_factory=dict)


def compute(texts: Mapping[str, str], package: str, cache: Path) -> Generated:
    """Return what ROS's tools make of the definitions in `texts`, which are keyed "srv/SetSpeed.srv".

    A definition that they cannot read is left out. `package` is the name of the package that holds the definitions; it
    is part of what is hashed.
    """
    if not texts:
        return Generated()
    kept, decided_by = Kept(cache / "hashes"), (package, json.dumps(sorted(texts.items())), ros_env.identity())
    if earlier := kept.find(Generated, *decided_by):
        return earlier[0]
    with tempfile.TemporaryDirectory(prefix="hashes-") as name:
        folder = Path(name)
        (folder / "out").mkdir()
        (folder / "texts.json").write_text(json.dumps({"package": package, "texts": dict(texts)}))
        box = sandbox.Sandbox(
            read_only={_WORKER: "/ws/worker.py", folder / "texts.json": "/ws/texts.json"},
            writable={folder / "out": "/ws/out"},
            environment=ros_env.environment(home=sandbox.HOME),
        )
        command = ["python3", "/ws/worker.py", "/ws/texts.json", "/ws/out/made.json"]
        result = sandbox.run(command, box, sandbox.Limits(wall_seconds=60.0))
        try:
            found = Generated(**json.loads((folder / "out" / "made.json").read_text()))
        except (OSError, ValueError, TypeError):
            return Generated()
    if result.ok:
        kept.keep(found, *decided_by)
    return found


def definitions(folder: Path) -> dict[str, str]:
    """Return the texts of the interface definitions below a package's folder, keyed "srv/SetSpeed.srv".

    Where two have the same key, the shallower one counts.
    """
    found: dict[str, str] = {}
    paths = [Path(here, name) for here, _, names in os.walk(folder) for name in names if name.endswith(_SUFFIXES)]
    for path in sorted(paths, key=lambda path: (len(path.parts), path))[:_MAX_FILES]:
        text = untrusted.read_text(path, _MAX_BYTES, errors="replace", newline=None)
        if text is not None:
            found.setdefault(f"{path.parent.name}/{path.name}", text)
    return found
