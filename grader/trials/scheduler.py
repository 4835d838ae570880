"""Run trials in parallel, each worker process in a network namespace of its own. The side of the grader."""

from __future__ import annotations

import compileall
import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path

from grader import KIT, evidence
from grader.course import Course
from grader.errors import GraderError
from grader.evidence import Kind, Reason
from grader.host import dds_domain, namespaces, ros_env, shortage, turns
from grader.trials.plan import TrialPlan
from grader.trials.request import (
    ALL_BEHIND_S,
    CANNOT,
    LATE_VARIABLE,
    PATIENCE_S,
    READY,
    TrialRequest,
    not_started,
)
from grader.words import say

_KILLED = (-signal.SIGKILL, 128 + signal.SIGKILL)  # bubblewrap itself, or the worker in it
_CRASHED = {
    status
    for crash in (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGILL, signal.SIGFPE)
    for status in (-crash, 128 + crash)
}
_STOP_S = 5.0
SHORT_PATIENCE_S = 5.0  # without time spent waiting for a CPU; start and end of a trial together take 0.7 to 1.0 s
_TRIAL_CAP_S = 900.0  # wall time; the limits inside a trial do not count time spent waiting for a CPU
_WAITERS = 2  # workers for trials that mostly wait
_LOG_CHARACTERS = 2000
_DISCOVERY = Path(__file__).parent / "discovery.xml"
_SHOWN = (KIT / "grader" / "ros2", Path(__file__).parent / "in_node")
"""What sandboxes of trials show of the kit; without byte code each launch would compile three thousand lines."""

Queue = queue.SimpleQueue[TrialPlan]


def run(
    plans: Iterable[TrialPlan],
    course: Course,
    *,
    install: Path,
    contract: Path,
    folder: Path,
    seed: int,
    workers: int | None = None,
    package: Path | None = None,
    ros_name: str = "",
    best_effort: bool = False,
    progress: Callable[[str], None] = lambda _name: None,
) -> dict[str, evidence.Trial]:
    """Run the trials and return their facts by name.

    Args:
        plans: the trials.
        course: the assignment that they belong to.
        install: the submission's install tree.
        contract: the install tree of the contract's interfaces.
        folder: where workers write the evidence, one file for each trial.
        seed: determines speeds, places and noise.
        workers: how many trials run at once, by default up to two per core and up to four in all. Trials that mostly
            wait run in addition to these.
        package: the package's source folder.
        ros_name: the name under which the package was installed, by default the course's.
        best_effort: whether the simulated sensors publish best effort.
        progress: called with the name of each trial when it ends.

    Raises:
        GraderError: this machine cannot run the trials.
    """
    computing, waiting = Queue(), Queue()
    for program in _SHOWN:
        compileall.compile_dir(program, quiet=2)  # what cannot be written is compiled by each sandbox, as before
    plans = list(plans)
    for plan in _mixed(plans):
        (waiting if plan.real_time or plan.mostly_waits else computing).put(plan)
    count = workers or _worth_starting(len(plans))
    waiters = min(_WAITERS, waiting.qsize())
    start = partial(start_worker, course, _environment(contract, folder), folder)
    trials = _Trials(start, install, folder, seed, package, progress, ros_name or course.package, best_effort)
    threads = [_Worker((computing, waiting), trials, turns.free_slot) for _ in range(count)]
    threads += [_Worker((waiting,), trials, contextlib.nullcontext) for _ in range(waiters)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    problem = next((thread.problem for thread in threads if thread.problem), None)
    if problem:
        raise problem
    return trials.found


def start_worker(course: Course, environment: Mapping[str, str], folder: Path, name: str) -> subprocess.Popen[str]:
    """Start a worker in a network namespace of its own, with its log in `folder`, and return it when it is ready.

    Raises:
        GraderError: it does not start.
    """
    log = folder / f"worker-{name}.log"
    with log.open("w") as stderr:
        worker = subprocess.Popen(
            namespaces.private_network([sys.executable, "-m", "grader.trials.worker", str(course.folder)]),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            env=dict(environment),
            cwd=folder,
            text=True,
        )
    assert worker.stdout is not None
    if worker.stdout.readline().strip() == READY:
        return worker
    worker.kill()
    worker.communicate()
    said = log.read_text().strip()[-_LOG_CHARACTERS:]
    raise GraderError(
        shortage.explain_output(said)
        or shortage.explain_disk(folder)
        or say("The trial worker did not start:\n{said}\nRun `grader doctor`.", said=said)
    )


def _mixed(plans: Sequence[TrialPlan]) -> list[TrialPlan]:
    """Return the long plans, then the others with each file's plans spread evenly: these wait at the same moments."""
    of_file = Counter(plan.script.__module__ for plan in plans)
    seen = Counter[str]()
    places = []
    for plan in plans:
        file = plan.script.__module__
        places.append(-1.0 if plan.takes_long else seen[file] / of_file[file])
        seen[file] += 1
    return [plan for _, plan in sorted(zip(places, plans, strict=True), key=lambda pair: pair[0])]


def _worth_starting(trials: int) -> int:
    """Return how many workers to start for this number of trials."""
    return min(turns.PER_CORE * (os.cpu_count() or 1), 4, trials)


def _environment(contract: Path, folder: Path) -> dict[str, str]:
    home = folder / "worker-home"
    home.mkdir(parents=True, exist_ok=True)
    late = {LATE_VARIABLE: os.environ[LATE_VARIABLE]} if LATE_VARIABLE in os.environ else {}
    return observer_environment(contract, home=home) | namespaces.inherited() | ros_env.inherited() | late


def observer_environment(contract: Path, *, home: Path) -> dict[str, str]:
    """Return the environment for a process that observes nodes; the contract's interfaces come first on its path."""
    return ros_env.environment(contract, home=home, wheels=True) | {"FASTRTPS_DEFAULT_PROFILES_FILE": str(_DISCOVERY)}


@dataclass(frozen=True)
class _Trials:
    """What all trials of a run have in common. `start` starts a worker; `found` collects the facts of each trial."""

    start: Callable[[str], subprocess.Popen[str]]
    install: Path
    folder: Path
    seed: int
    package: Path | None
    progress: Callable[[str], None]
    ros_name: str
    best_effort: bool
    found: dict[str, evidence.Trial] = field(default_factory=dict)

    def patience_s(self, plan: TrialPlan) -> float:
        """Return how long a trial waits for its node: less if the node was absent in two trials and ready in none.

        Without this, a package whose nodes never start took 262 s. The trial still runs, in case its node does start.
        Launched nodes count separately: a broken launch file says nothing about the nodes themselves.
        """
        earlier = [
            trial
            for trial in list(self.found.values())
            if trial.node == plan.node and bool(trial.launch) == bool(plan.launch)
        ]
        absent = sum(trial.ended is not None and trial.ended.kind is Kind.NOT_UP for trial in earlier)
        return SHORT_PATIENCE_S if absent >= 2 and not any(trial.ready for trial in earlier) else PATIENCE_S


class _Worker(threading.Thread):
    """Sends trials to one worker process until the queues are empty, and starts a new process if that one dies.

    Each trial runs in a context from `slot`, which it may have to wait for.
    """

    def __init__(
        self,
        todo: Sequence[Queue],
        trials: _Trials,
        slot: Callable[[], contextlib.AbstractContextManager[None]],
    ) -> None:
        super().__init__(daemon=True)
        self.problem: Exception | None = None
        self._todo, self._trials, self._slot = todo, trials, slot
        self._process: subprocess.Popen[str] | None = None
        self._domain = 0

    def run(self) -> None:
        try:
            while self._run_next():
                pass
        except Exception as error:  # re-raised by the caller, who joins this thread
            self.problem = error
        finally:
            self._stop()

    def _run_next(self) -> bool:
        """Run the next trial once a slot is free; return False if no trial is left."""
        with self._slot():
            if (plan := self._next()) is None:
                return False
            if sum(trial.behind_s for trial in list(self._trials.found.values())) > ALL_BEHIND_S:
                waited = Reason(Kind.WAITED, seconds=ALL_BEHIND_S)
                self._trials.found[plan.name] = not_started(plan, self._trials.seed, ended=waited)
            else:
                self._trials.found[plan.name] = self._run_trial(plan)
        self._trials.progress(plan.name)
        return True

    def _next(self) -> TrialPlan | None:
        """Return a trial from the first queue that is not empty, None if all are."""
        for each in self._todo:
            with contextlib.suppress(queue.Empty):
                return each.get_nowait()
        return None

    def _run_trial(self, plan: TrialPlan, *, has_crashed: bool = False) -> evidence.Trial:
        trials = self._trials
        process = self._process = self._process or trials.start(self.name)
        out = trials.folder.resolve() / f"{plan.name}.json"
        out.unlink(missing_ok=True)
        # None twice in a row: the participants of an ended trial stay on their domain's graph for a while.
        with dds_domain.free(after=self._domain) as self._domain:
            request = TrialRequest(
                plan.name, str(trials.install), trials.seed, self._domain, str(out),
                package=str(trials.package or ""), ros_name=trials.ros_name, patience_s=trials.patience_s(plan),
                best_effort=trials.best_effort,
            )  # fmt: skip
            answer, out_of_time = _ask(process, request)
        if answer.startswith(CANNOT):
            raise GraderError(answer.removeprefix(CANNOT))
        if answer == plan.name:
            return evidence.from_json(out.read_text(), evidence.Trial)
        ended_by_itself = self._stop()
        if out.is_file():  # the worker died after the trial
            return evidence.from_json(out.read_text(), evidence.Trial)
        status = process.returncode
        if status in _KILLED and ended_by_itself and not out_of_time:
            raise GraderError(say(shortage.KILLED))
        if status in _CRASHED:
            if not has_crashed:
                return self._run_trial(plan, has_crashed=True)
            # One crash may be chance, so retry once; a submission that crashes the observer every time scores nothing.
            return not_started(plan, trials.seed, ended=Reason(Kind.OBSERVER_CRASHED))
        return not_started(plan, trials.seed, f"the trial's worker ended (answer {answer!r}, status {status})")

    def _stop(self) -> bool:
        """End the worker process; return False if it had to be killed."""
        process, self._process = self._process, None
        if process is None:
            return True
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.close()
        try:
            process.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return False
        finally:
            process.stdout.close()
        return True


def _ask(process: subprocess.Popen[str], request: TrialRequest) -> tuple[str, bool]:
    """Return a worker's answer to a request, "" if it died, and whether it was killed because its time was up."""
    assert process.stdin is not None
    assert process.stdout is not None
    out_of_time = threading.Event()

    def end() -> None:
        out_of_time.set()
        process.kill()

    timer = threading.Timer(_TRIAL_CAP_S, end)
    timer.start()
    try:
        process.stdin.write(json.dumps(asdict(request)) + "\n")
        process.stdin.flush()
        return process.stdout.readline().strip(), out_of_time.is_set()
    except OSError:
        return "", out_of_time.is_set()
    finally:
        timer.cancel()
