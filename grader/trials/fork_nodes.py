"""Fork nodes in the sandbox, one after another, from a process that has imported what nearly every node imports.

`node_server` is the host's side. A line on standard input is a request: to start a program, or to say a word, which
comes after all that was written before. No node can stop or kill this process: it is the first of its sandbox. A fork
becomes what the program would be if Python had started it: `__main__`, its arguments, its path.
"""

from __future__ import annotations

import builtins
import importlib
import json
import os
import sys
from contextlib import suppress
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any

from grader.sandbox.first_process import (
    empty_own_folders,
    forget_the_kit,
    freeze,
    import_ros,
    kill_others,
    shield,
    unshield,
)

Request = dict[str, Any]


def serve() -> Request:
    """Serve requests; return one to start a program, in a fork of its own."""
    forget_the_kit()
    import_ros()
    freeze()
    requests = os.fdopen(os.dup(0), "rb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    shield()
    for line in requests:
        request: Request = json.loads(line)
        if "command" in request:
            if os.fork() == 0:
                requests.close()
                unshield()
                return request
        else:
            if request["clear"]:
                kill_others()
                empty_own_folders()
            print(request["say"], flush=True)
    sys.exit()


def become(command: list[str], environment: dict[str, str]) -> ModuleType:
    """Give this process the arguments, environment and import path of a Python program; return its empty module."""
    known = os.environ["PYTHONPATH"].split(":")
    os.environ.update(environment)
    sys.argv, sys.orig_argv = command, [sys.executable, *command]
    first = [str(Path(command[0]).parent), *environment["PYTHONPATH"].split(":")]
    sys.path[:] = [*first, *(path for path in sys.path if path not in known)]
    sys.modules.pop("sitecustomize", None)
    with suppress(ImportError):
        importlib.import_module("sitecustomize")  # which notes something only from the first trial on
    main = ModuleType("__main__")
    main.__dict__.update(__file__=command[0], __builtins__=builtins)
    sys.modules["__main__"] = main
    sys.excepthook = _print_without_this_file
    return main


def _print_without_this_file(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    sys.__excepthook__(kind, error.with_traceback(trace.tb_next if trace else None), trace.tb_next if trace else None)


if __name__ == "__main__":
    asked = serve()
    module = become(asked["command"], asked["environment"])
    program = str(module.__file__)
    exec(compile(Path(program).read_bytes(), program, "exec", dont_inherit=True), module.__dict__)
