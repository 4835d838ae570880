"""Run commands in this process's network namespace: read one JSON object per line, answer each with one."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

background = []
for line in sys.stdin:
    wanted = json.loads(line)
    log = wanted.get("background")
    out = Path(log).open("w") if log else subprocess.PIPE  # noqa: SIM115 - the process keeps it
    process = subprocess.Popen(
        wanted["words"],
        stdin=subprocess.DEVNULL,
        stdout=out,
        stderr=subprocess.STDOUT if log else subprocess.PIPE,
        text=True,
    )
    answer: dict[str, object] = {"pid": process.pid}
    if log:
        background.append(process)
    else:
        try:
            said, err = process.communicate(timeout=wanted.get("interrupt_s", 60))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
            said, err = process.communicate(timeout=30)
        answer.update(code=process.returncode, out=said, err=err)
    print(json.dumps(answer), flush=True)
for process in background:
    process.send_signal(signal.SIGINT)
for process in background:
    process.wait(timeout=20)
os._exit(0)
