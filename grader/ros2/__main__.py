"""Run the command from any place and name of this folder: `python3 FOLDER launch PACKAGE FILE`."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

if __package__:
    from .cli import main
else:
    # Started by the folder's path: Python has put the folder itself first on sys.path, where it hides other modules.
    here = Path(__file__).resolve().parent
    sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != here]
    package = sys.modules["ros2kit"] = ModuleType("ros2kit")
    package.__path__ = [str(here)]
    main = importlib.import_module("ros2kit.cli").main

if __name__ == "__main__":
    sys.exit(main())
