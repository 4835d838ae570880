"""Run ament_pep257's rules over files and print the findings as JSON. A process of its own: python -I -m ..."""

from __future__ import annotations

import json
import logging
import sys
from typing import Any

import pydocstyle
from ament_pep257.main import _ament_ignore
from pydocstyle.violations import Error


def main() -> int:
    """Print [path, line of the definition, line of the docstring, rule, text] of each finding in the files named."""
    logging.disable()
    found: list[list[Any]] = []
    for error in pydocstyle.check(sys.argv[1:], ignore=_ament_ignore, ignore_inline_noqa=True):
        # Anything else is a file that cannot be parsed, which worker.py reports better.
        if isinstance(error, Error):
            rule, _, text = error.message.partition(": ")
            found.append([error.definition.module.name, error.definition.start, error.line, rule, text])
    print(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
