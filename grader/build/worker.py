"""Hash the interface definitions in a JSON file and write the hashes to another. Runs in the sandbox, by itself."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path


def main(definitions: Path, answer: Path) -> None:
    """Write the hashes of the texts in `definitions` to `answer`."""
    request = json.loads(definitions.read_text())
    texts: dict[str, str] = request["texts"]
    package = request["package"]
    found = _hashes(package, texts)
    if found is None:
        # One bad definition fails the whole set. So find the good ones, and hash each of the others beside them: a
        # good definition that uses another one's type cannot be read alone.
        alone = {name: _hashes(package, {name: text}) for name, text in texts.items()}
        good = {name: texts[name] for name, hashes in alone.items() if hashes}
        found = {}
        for name, text in texts.items():
            found |= alone[name] or _hashes(package, {**good, name: text}) or {}
    answer.write_text(json.dumps(found))


def _hashes(package: str, texts: Mapping[str, str]) -> dict[str, str] | None:
    """Return the RIHS01 hash of each definition by its name, None if ROS's tools fail on any of them."""
    convert_to_idl = importlib.import_module("rosidl_adapter").convert_to_idl
    generate_type_hash = importlib.import_module("rosidl_generator_type_description").generate_type_hash
    folder = Path(tempfile.mkdtemp())
    try:
        idl = folder / "idl"
        for name, text in texts.items():
            path = folder / "package" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            convert_to_idl(folder / "package", package, Path(name), idl)
        share = Path(os.environ["AMENT_PREFIX_PATH"].rpartition(":")[2]) / "share"
        arguments = {
            "package_name": package,
            "output_dir": str(folder / "hashes"),
            "idl_tuples": [f"{idl}:{Path(name).with_suffix('.idl')}" for name in texts],
            "include_paths": [f"{path.name}:{path}" for path in share.iterdir() if path.is_dir()],
        }
        (folder / "arguments.json").write_text(json.dumps(arguments))
        generate_type_hash(str(folder / "arguments.json"))
        found = {}
        for name in texts:
            stem = str(Path(name).with_suffix(""))
            described = json.loads((folder / "hashes" / f"{stem}.json").read_text())
            wanted = f"{package}/{stem}"
            found[stem] = next(e["hash_string"] for e in described["type_hashes"] if e["type_name"] == wanted)
        return found
    except Exception as error:  # a hostile definition can make the tools raise anything
        print(f"{type(error).__name__}: {error}")
        return None
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
