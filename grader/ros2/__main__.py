"""Run the command from any place and name of this folder: `python3 FOLDER launch PACKAGE FILE`."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path


def _main() -> int:
    if __package__:
        from .cli import main

        return main()
    # Started by the folder's path: Python has put the folder itself first on sys.path, where it hides other modules.
    here = Path(__file__).resolve().parent
    sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != here]
    spec = importlib.util.spec_from_file_location(
        "ros2kit", here / "__init__.py", submodule_search_locations=[str(here)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["ros2kit"] = module
    spec.loader.exec_module(module)
    run = importlib.import_module("ros2kit.cli").main
    code: int = run()
    return code


if __name__ == "__main__":
    sys.exit(_main())
