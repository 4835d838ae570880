"""Runs commands in the network that it is started in: reads one JSON object per line, answers with one."""

import json
import os
import signal
import subprocess
import sys

for line in sys.stdin:
    wanted = json.loads(line)
    process = subprocess.Popen(
        wanted["words"],
        env={**os.environ, **wanted.get("env", {})},
        cwd=wanted.get("cwd"),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE if not wanted.get("background") else open(wanted["background"], "w"),  # noqa: PTH123, SIM115 - the process keeps it
        stderr=subprocess.PIPE if not wanted.get("background") else subprocess.STDOUT,
        text=True,
    )
    answer = {"pid": process.pid}
    if not wanted.get("background"):
        try:
            out, err = process.communicate(timeout=wanted.get("interrupt_s", 60))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=30)
        answer |= {"code": process.returncode, "out": out, "err": err}
    print(json.dumps(answer), flush=True)
