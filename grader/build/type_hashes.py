"""The type hashes of interface definitions, computed from their text by ROS's own tools.

What a build installs beside an interface was written by the submission's build, which can write anything. So the
grader computes the hashes itself, from the text, in a process behind a wall that runs nothing of the submission.
This file is mounted in there and is the program as well.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

_CAP = 100_000
_MOST = 200
_SUFFIXES = (".msg", ".srv", ".action")


def compute(texts: Mapping[str, str], package: str, cache: Path) -> dict[str, str]:
    """Return the RIHS01 hash for each of `texts`, which are named "srv/SetSpeed.srv" and the like.

    The result's names are "srv/SetSpeed". A definition that ROS's tools cannot read has none. `package` is the name of
    the package they belong to, which is part of what is hashed.
    """
    from grader import sandbox
    from grader.host import ros_env

    digest = hashlib.sha256(json.dumps([package, sorted(texts.items())]).encode()).hexdigest()[:40]
    known = cache / "hashes" / f"{digest}.sealed.json"
    with contextlib.suppress(OSError, ValueError, TypeError, KeyError, AttributeError):
        kept = json.loads(known.read_text())
        if kept["seal"] == _seal(kept["hashes"]):  # a damaged one is made anew
            return {str(name): str(found) for name, found in kept["hashes"].items()}
    with tempfile.TemporaryDirectory(prefix="hashes-") as scratch:
        room = Path(scratch)
        (room / "out").mkdir()
        (room / "texts.json").write_text(json.dumps({"package": package, "texts": dict(texts)}))
        box = sandbox.Sandbox(
            read_only={Path(__file__): "/ws/type_hashes.py", room / "texts.json": "/ws/texts.json"},
            writable={room / "out": "/ws/out"},
            environment=ros_env.environment(home=sandbox.HOME),
        )
        command = ["python3", "/ws/type_hashes.py", "/ws/texts.json", "/ws/out/hashes.json"]
        result = sandbox.run(command, box, sandbox.Limits(wall_seconds=60.0))
        try:
            found = {str(k): str(v) for k, v in json.loads((room / "out" / "hashes.json").read_text()).items()}
        except (OSError, ValueError):
            return {}
    if result.ok:
        known.parent.mkdir(parents=True, exist_ok=True)
        part = known.with_suffix(f".{os.getpid()}")
        part.write_text(json.dumps({"hashes": found, "seal": _seal(found)}))
        part.rename(known)
    return found


def _seal(hashes: Mapping[str, str]) -> str:
    return hashlib.sha256(json.dumps(hashes, sort_keys=True).encode()).hexdigest()


def texts_in(folder: Path) -> dict[str, str]:
    """Return the interface definitions below a package's folder by their last two names, the shallowest first."""
    found: dict[str, str] = {}
    paths = [Path(here, name) for here, _, names in os.walk(folder) for name in names if name.endswith(_SUFFIXES)]
    for path in sorted(paths, key=lambda path: (len(path.parts), path))[:_MOST]:
        if path.is_file() and not path.is_symlink() and path.stat().st_size <= _CAP:
            text = path.read_text(encoding="utf-8", errors="replace")
            found.setdefault(f"{path.parent.name}/{path.name}", text)
    return found


# What follows runs behind the box.


def main() -> None:
    """Write the hashes of the definitions in argv[1] to argv[2]."""
    asked, answer = (Path(path) for path in sys.argv[1:])
    request = json.loads(asked.read_text())
    texts: dict[str, str] = request["texts"]
    package = request["package"]
    found = _hashes(package, texts)
    if found is None:
        # One that cannot be read takes all others along: those that can be, together with the messages they use.
        alone = {name: _hashes(package, {name: text}) for name, text in texts.items()}
        good = {name: texts[name] for name, hashes in alone.items() if hashes}
        found = {}
        for name, text in texts.items():
            found |= alone[name] or _hashes(package, {**good, name: text}) or {}
    answer.write_text(json.dumps(found))


def _hashes(package: str, texts: Mapping[str, str]) -> dict[str, str] | None:
    convert_to_idl = importlib.import_module("rosidl_adapter").convert_to_idl
    generate_type_hash = importlib.import_module("rosidl_generator_type_description").generate_type_hash
    room = Path(tempfile.mkdtemp())
    try:
        idl = room / "idl"
        for name, text in texts.items():
            path = room / "package" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            convert_to_idl(room / "package", package, Path(name), idl)
        share = Path(os.environ["AMENT_PREFIX_PATH"].rpartition(":")[2]) / "share"
        arguments = {
            "package_name": package,
            "output_dir": str(room / "hashes"),
            "idl_tuples": [f"{idl}:{Path(name).with_suffix('.idl')}" for name in texts],
            "include_paths": [f"{path.name}:{path}" for path in share.iterdir() if path.is_dir()],
        }
        (room / "arguments.json").write_text(json.dumps(arguments))
        generate_type_hash(str(room / "arguments.json"))
        found = {}
        for name in texts:
            stem = str(Path(name).with_suffix(""))
            described = json.loads((room / "hashes" / f"{stem}.json").read_text())
            wanted = f"{package}/{stem}"
            found[stem] = next(e["hash_string"] for e in described["type_hashes"] if e["type_name"] == wanted)
        return found
    except Exception as error:  # whatever a hostile definition does to the tools
        print(f"{type(error).__name__}: {error}")
        return None
    finally:
        shutil.rmtree(room, ignore_errors=True)


if __name__ == "__main__":
    main()
