"""What several tests share: examples, runs of commands, notebooks."""

from pathlib import Path
from typing import Any

import yaml


def beside(file: str) -> Any:
    """Return what the YAML file beside a test holds: the programs that it runs, and the texts that it gives to read."""
    return yaml.safe_load(Path(file).with_suffix(".yaml").read_text(encoding="utf-8"))
