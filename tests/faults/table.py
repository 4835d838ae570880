"""Put each fault of `FAULTS` into a copy of the kit, one at a time, and print which tests notice it.

    PYTHONPATH=.:tests python -m faults.table [--further] [FAULT ...]

The copy is a clone of the last commit, set up by itself. The test that noticed the fault the last time runs first, then
those of its own room, then the rest of `make test`, each until the first failure. With `--further`, a fault that
`make test` does not notice is tried on `make test-notebooks` and then on the slow tests. The exit status is 1 if
`make test` misses more than `MAY_MISS`.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from faults import FAULTS, Fault
from grader import KIT

MAY_MISS = 4
QUICK = "not slow and not notebooks"
FURTHER = {"test-notebooks": "notebooks", "test-all": "slow"}
_FAILED = re.compile(r"^(?:FAILED|ERROR) (tests/.+?)(?: - .*)?$", re.MULTILINE)


def clone(folder: Path) -> Path:
    """Return a copy of the kit's last commit in `folder`, with an environment of its own."""
    kit = folder / "kit"
    subprocess.run(["git", "clone", "--quiet", str(KIT), str(kit)], check=True)
    subprocess.run(["make", "--silent", "-C", str(kit), "setup"], check=True, capture_output=True)
    return kit


def room(fault: Fault, kit: Path) -> str:
    """Return the folder of the tests that mirror the fault's file."""
    folder = Path("tests") / Path(fault.file).parent
    while not (kit / folder).is_dir():
        folder = folder.parent
    if "courses" in fault.file:
        folder = Path("tests/grader/checks")
    return str(folder)


def first_failure(kit: Path, selection: str, *where: str) -> str:
    """Return the name of the first test that fails, "" if all pass."""
    words = ["-q", "-x", "-m", selection, "-n", "2", "--dist", "loadfile", "-p", "no:cacheprovider", *where]
    run = [str(kit / ".venv/bin/python"), "-m", "pytest", *words]
    done = subprocess.run(run, cwd=kit, capture_output=True, text=True, check=False)
    if done.returncode in (0, 5):  # 5: none is selected
        return ""
    failed = _FAILED.search(done.stdout)
    return failed[1] if failed else f"pytest ended with {done.returncode}: {done.stdout[-300:]}{done.stderr[-300:]}"


def noticed(fault: Fault, kit: Path, further: bool) -> tuple[str, str]:
    """Return which command notices the fault, and by which test; ("nothing", "") if none does."""
    path = kit / fault.file
    whole = path.read_text()
    path.write_text(whole.replace(fault.old, fault.new))
    try:
        near = room(fault, kit)
        rest = ["tests", "--ignore=tests/test_faults.py"] + [f"--ignore={near}"] * (near != "tests")
        if test := next(
            filter(None, (first_failure(kit, QUICK, *where) for where in ([fault.seen_by], [near], rest))), ""
        ):
            return "test", test
        for command, selection in FURTHER.items() if further else ():
            if test := first_failure(kit, selection, "tests"):
                return command, test
        return "nothing", ""
    finally:
        path.write_text(whole)


def main(words: list[str]) -> int:
    """Print the table; return 1 if `make test` misses too many."""
    names = [word for word in words if word != "--further"]
    chosen = [fault for fault in FAULTS if not names or fault.name in names]
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        kit = clone(Path(folder))
        for fault in chosen:
            began = time.monotonic()
            command, test = noticed(fault, kit, "--further" in words)
            missed += command != "test"
            print(f"{fault.name:<62} {command:<14} {time.monotonic() - began:5.0f} s  {test}", flush=True)
    print(f"{len(chosen) - missed} of {len(chosen)} are noticed by `make test`")
    return 1 if missed > MAY_MISS else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
