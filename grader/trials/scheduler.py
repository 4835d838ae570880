"""Run trials in parallel, each worker in a network namespace of its own. The side that the grader sees."""

from __future__ import annotations

import json
import os
import queue
import secrets
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path

from grader import evidence
from grader.errors import GraderError
from grader.host import namespaces, ros_env, shortage
from grader.trials.catalog import TrialPlan
from grader.trials.request import CANNOT, LATE_VARIABLE, OBSERVER_ENDED, READY, Request, unjudged

_KILLED = (-signal.SIGKILL, 128 + signal.SIGKILL)  # bubblewrap itself, or the host within
_CRASHED = {
    status
    for crash in (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGILL, signal.SIGFPE)
    for status in (-crash, 128 + crash)
}
_TRIAL_CAP_S = 900.0  # of wall time: those inside count no time in which others had the cores


def run(
    plans: Iterable[TrialPlan],
    *,
    install: Path,
    contract: Path,
    folder: Path,
    seed: int,
    workers: int | None = None,
    package: Path | None = None,
    progress: Callable[[str], None] = lambda _name: None,
) -> dict[str, evidence.Trial]:
    """Run the trials and return their facts by name.

    Args:
        plans: the trials.
        install: the submission's install tree.
        contract: the install tree of the contract's interfaces.
        folder: where workers leave what they saw, one file a trial.
        seed: decides speeds, places and noise.
        workers: how many trials run at once; by default one more than cores, for each waits at times, and three at
            most. Those in real time, which mostly wait, run beside them.
        package: the package's source folder.
        progress: told the name of each trial that has ended.
    """
    todo: queue.SimpleQueue[TrialPlan] = queue.SimpleQueue()
    slow: queue.SimpleQueue[TrialPlan] = queue.SimpleQueue()
    for plan in plans:
        (slow if plan.real_time else todo).put(plan)
    found: dict[str, evidence.Trial] = {}
    count = workers or min(3, 1 + (os.cpu_count() or 1))
    queues = [todo] * count + [slow] * (not slow.empty())
    workers_ = [_Worker(each, found, install, contract, folder, seed, package, progress) for each in queues]
    for worker in workers_:
        worker.start()
    for worker in workers_:
        worker.join()
    problem = next((worker.problem for worker in workers_ if worker.problem), None)
    if problem:
        raise problem
    return found


def observer_environment(contract: Path, *, home: Path) -> dict[str, str]:
    """Return the environment of a process that observes nodes, with the contract's interfaces on top."""
    return ros_env.environment(contract, home=home) | {"FASTRTPS_DEFAULT_PROFILES_FILE": str(_DISCOVERY)}


_DISCOVERY = Path(__file__).parent / "discovery.xml"


def _end(host: subprocess.Popen[str], capped: threading.Event) -> None:
    capped.set()
    host.kill()


def _passed_on() -> dict[str, str]:
    """Return what a host hears of our environment: how late to join, and whether to do without walls."""
    return {name: os.environ[name] for name in (LATE_VARIABLE, namespaces.UNSAFE_VARIABLE) if name in os.environ}


class _Worker(threading.Thread):
    """Feeds one host process with trials until there are none left; starts it anew when it dies."""

    def __init__(
        self,
        todo: queue.SimpleQueue[TrialPlan],
        found: dict[str, evidence.Trial],
        install: Path,
        contract: Path,
        folder: Path,
        seed: int,
        package: Path | None,
        progress: Callable[[str], None],
    ) -> None:
        super().__init__(daemon=True)
        self.problem: Exception | None = None
        self._todo, self._found = todo, found
        self._install, self._contract, self._folder = install, contract, folder
        self._seed, self._package, self._progress = seed, package, progress
        self._host: subprocess.Popen[str] | None = None

    def run(self) -> None:
        try:
            while True:
                try:
                    plan = self._todo.get_nowait()
                except queue.Empty:
                    return
                self._found[plan.name] = self._trial(plan)
                self._progress(plan.name)
        except Exception as error:  # handed to the caller, who joins
            self.problem = error
        finally:
            self._stop()

    def _trial(self, plan: TrialPlan, *, has_crashed: bool = False) -> evidence.Trial:
        host = self._host or self._start()
        out = self._folder.resolve() / f"{plan.name}.json"
        # 1 to 100: above that DDS would need ports beyond the range of some kernels' ephemeral ones.
        domain_id, package = 1 + secrets.randbelow(100), str(self._package or "")
        out.unlink(missing_ok=True)
        request = Request(plan.name, str(self._install), self._seed, domain_id, str(out), package)
        assert host.stdin is not None
        assert host.stdout is not None
        capped = threading.Event()
        timer = threading.Timer(_TRIAL_CAP_S, _end, [host, capped])
        timer.start()
        try:
            host.stdin.write(json.dumps(asdict(request)) + "\n")
            host.stdin.flush()
            answer = host.stdout.readline().strip()
        except OSError:
            answer = ""
        finally:
            timer.cancel()
        if answer.startswith(CANNOT):
            raise GraderError(answer.removeprefix(CANNOT))
        if answer != plan.name:
            self._stop()
            if out.is_file():  # the trial was over when its host died
                return evidence.from_json(out.read_text(), evidence.Trial)
            if host.returncode in _KILLED and not capped.is_set():
                raise GraderError(shortage.KILLED)
            if host.returncode in _CRASHED:
                if not has_crashed:
                    return self._trial(plan, has_crashed=True)
                # Once may be chance. Whoever makes it happen whenever it is looked at has nothing to gain by it.
                return unjudged(plan, self._seed, "", ended=OBSERVER_ENDED)
            return unjudged(plan, self._seed, f"the trial's host ended (answer {answer!r}, status {host.returncode})")
        return evidence.from_json(out.read_text(), evidence.Trial)

    def _start(self) -> subprocess.Popen[str]:
        home = self._folder / "host-home"
        home.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-m", "grader.trials.worker"]
        log_path = self._folder / f"host-{self.name}.log"
        with log_path.open("w") as log:
            self._host = subprocess.Popen(
                namespaces.private_network(command),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=observer_environment(self._contract, home=home) | _passed_on(),
                cwd=self._folder,
                text=True,
            )
        assert self._host.stdout is not None
        if self._host.stdout.readline().strip() != READY:
            said = log_path.read_text().strip()[-2000:]
            raise GraderError(
                shortage.in_text(said)
                or shortage.full(self._folder)
                or f"The host of the trials did not start:\n{said}\nRun `grader doctor`."
            )
        return self._host

    def _stop(self) -> None:
        host, self._host = self._host, None
        if host is None:
            return
        assert host.stdin is not None
        assert host.stdout is not None
        host.stdin.close()
        try:
            host.wait(5.0)
        except subprocess.TimeoutExpired:
            host.kill()
            host.wait()
        host.stdout.close()
