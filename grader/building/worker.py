"""Hash the interface definitions in a JSON file and generate their Python. Runs in the sandbox, by itself."""

from __future__ import annotations

import hashlib
import importlib
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

Made = dict[str, dict[str, str]]
"""What the tools make of definitions: "hashes" by name, "modules" and "exports" by the path of a Python file."""


def main(definitions: Path, answer: Path) -> None:
    """Write what ROS's tools make of the texts in `definitions` to `answer`."""
    request = json.loads(definitions.read_text())
    texts: dict[str, str] = request["texts"]
    package = request["package"]
    found = _make(package, texts)
    if found is None:
        # One bad definition fails the whole set. So find the good ones, and try each of the others beside them: a good
        # definition that uses another one's type cannot be read alone.
        alone = {name: _make(package, {name: text}) for name, text in texts.items()}
        good = {name: texts[name] for name, made in alone.items() if made}
        found = {"hashes": {}, "modules": {}, "exports": {}}
        for name, text in texts.items():
            made = alone[name] or _make(package, {**good, name: text}) or {}
            for kind, entries in made.items():
                for key, value in entries.items():
                    found[kind][key] = found[kind].get(key, "") + value if kind == "exports" else value
    answer.write_text(json.dumps(found))


def _make(package: str, texts: Mapping[str, str]) -> Made | None:
    """Return what ROS's tools make of the definitions, None if they fail on any of them."""
    convert_to_idl = importlib.import_module("rosidl_adapter").convert_to_idl
    folder = Path(tempfile.mkdtemp())
    try:
        idl = folder / "idl"
        for name, text in texts.items():
            path = folder / "package" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            convert_to_idl(folder / "package", package, Path(name), idl)
        arguments = {
            "package_name": package,
            "idl_tuples": [f"{idl}:{Path(name).with_suffix('.idl')}" for name in texts],
        }
        names = [str(Path(name).with_suffix("")) for name in texts]
        return {"hashes": _hashes(folder, arguments, names), **_python(folder, arguments)}
    except Exception as error:  # a hostile definition can make the tools raise anything
        print(f"{type(error).__name__}: {error}")
        return None
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _hashes(folder: Path, arguments: Mapping[str, object], names: list[str]) -> dict[str, str]:
    """Return the RIHS01 hash of each interface by its name."""
    generate_type_hash = importlib.import_module("rosidl_generator_type_description").generate_type_hash
    paths = {"include_paths": [f"{path.name}:{path}" for path in _share().iterdir() if path.is_dir()]}
    generate_type_hash(_written(folder / "hashes", {**arguments, **paths}))
    found = {}
    for name in names:
        described = json.loads((folder / "hashes" / f"{name}.json").read_text())
        wanted = f"{arguments['package_name']}/{name}"
        found[name] = next(e["hash_string"] for e in described["type_hashes"] if e["type_name"] == wanted)
    return found


def _python(folder: Path, arguments: Mapping[str, object]) -> Made:
    """Return the SHA-256 of each generated module, and the texts of the `__init__.py` that export their types."""
    generate_py = importlib.import_module("rosidl_generator_py.generate_py_impl").generate_py
    templates = {"template_dir": str(_share() / "rosidl_generator_py" / "resource"), "target_dependencies": []}
    out = folder / "python"
    generate_py(_written(out, {**arguments, **templates}), [])
    modules, exports = {}, {}
    for path in sorted(out.rglob("*.py")):
        name = path.relative_to(out).as_posix()
        if path.name == "__init__.py":
            exports[name] = path.read_text()
        else:
            modules[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return {"modules": modules, "exports": exports}


def _written(out: Path, arguments: Mapping[str, object]) -> str:
    """Write the arguments of a generator with this output folder to a file, and return its path."""
    out.mkdir()
    path = out.with_suffix(".json")
    path.write_text(json.dumps({**arguments, "output_dir": str(out)}))
    return str(path)


def _share() -> Path:
    return Path(os.environ["AMENT_PREFIX_PATH"].rpartition(":")[2]) / "share"


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
