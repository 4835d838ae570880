"""Run trials by worker processes, each in a network namespace of its own. The side of the grader."""

from __future__ import annotations

import compileall
import contextlib
import itertools
import json
import select
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from grader import KIT, evidence
from grader.course import Course
from grader.errors import GraderError
from grader.evidence import Kind, Reason
from grader.host import dds_domain, namespaces, ros_env, shortage
from grader.processes.jobs import Job, Turn, Where
from grader.trials.plan import TrialPlan
from grader.trials.request import ALL_BEHIND_S, CANNOT, PATIENCE_S, READY, TrialRequest, not_started
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
_LOG_CHARACTERS = 2000
_DISCOVERY = Path(__file__).parent / "discovery.xml"
_SHOWN = (KIT / "grader" / "ros2", Path(__file__).parent / "in_node")
"""What sandboxes of trials show of the kit; without byte code each launch would compile three thousand lines."""


@dataclass
class _Worker:
    """A worker process, and the domain of its last trial."""

    process: subprocess.Popen[str]
    domain: int = 0


class Observers:
    """Runs trials by worker processes, each in a network of its own. As a context manager it ends them.

    Safe to use from several threads: there are as many workers as there were trials at once.

    Args:
        course: the assignment that the trials belong to.
        install: the submission's install tree.
        contract: the install tree of the contract's interfaces.
        folder: where workers write the evidence, one file for each trial.
        seed: determines speeds, places and noise.
        package: the package's source folder.
        ros_name: the name under which the package was installed, by default the course's.
        best_effort: whether the simulated sensors publish best effort.
    """

    def __init__(
        self,
        course: Course,
        *,
        install: Path,
        contract: Path,
        folder: Path,
        seed: int,
        package: Path | None = None,
        ros_name: str = "",
        best_effort: bool = False,
    ) -> None:
        self._course, self._folder, self._seed = course, folder, seed
        self._request = partial(
            TrialRequest, install=str(install), seed=seed, package=str(package or ""),
            ros_name=ros_name or course.package, best_effort=best_effort,
        )  # fmt: skip
        self._contract = contract
        self._numbers = itertools.count(1)
        self._idle: list[_Worker] = []
        self._found: list[evidence.Trial] = []
        self._followed: dict[str, evidence.Trial] = {}

    def __enter__(self) -> Observers:
        """Compile what the sandboxes show of the kit, and return itself."""
        for program in _SHOWN:
            compileall.compile_dir(program, quiet=2)  # what cannot be written is compiled by each sandbox, as before
        return self

    def __exit__(self, *_: object) -> None:
        """End the workers."""
        for worker in self._idle:
            _end(worker.process)

    def run(self, plan: TrialPlan, then: Sequence[TrialPlan] = ()) -> evidence.Trial:
        """Run a trial and return its facts; then run those that follow it, whose facts `follower` returns.

        Raises:
            GraderError: this machine cannot run it.
        """
        left = [plan, *then]
        facts: dict[str, evidence.Trial] = {}
        while left:
            if sum(trial.behind_s for trial in self._found) > ALL_BEHIND_S:
                found = [not_started(left[0], self._seed, ended=Reason(Kind.WAITED, seconds=ALL_BEHIND_S))]
            else:
                found = self._observed(left)
            self._found += found
            facts |= {trial.name: trial for trial in found}
            left = left[len(found) :]
        self._followed |= facts
        return self._followed.pop(plan.name)

    def follower(self, plan: TrialPlan, _before: evidence.Trial) -> evidence.Trial:
        """Return the facts of a trial that has followed another; run it if it has not, as when that one was kept."""
        return self._followed.pop(plan.name, None) or self.run(plan)

    def patience_s(self, plan: TrialPlan) -> float:
        """Return how long a trial waits for its node: less if the node was absent in two trials and ready in none.

        Without this, a package whose nodes never start took 262 s. The trial still runs, in case its node does start.
        Launched nodes count separately: a broken launch file says nothing about the nodes themselves.
        """
        earlier = [
            trial for trial in self._found if trial.node == plan.node and bool(trial.launch) == bool(plan.launch)
        ]
        absent = sum(trial.ended is not None and trial.ended.kind is Kind.NOT_UP for trial in earlier)
        return SHORT_PATIENCE_S if absent >= 2 and not any(trial.ready for trial in earlier) else PATIENCE_S

    def _worker(self) -> _Worker:
        try:
            return self._idle.pop()
        except IndexError:
            environment = _environment(self._contract, self._folder)
            return _Worker(start_worker(self._course, environment, self._folder, str(next(self._numbers))))

    def _observed(self, plans: Sequence[TrialPlan], *, has_crashed: bool = False) -> list[evidence.Trial]:
        """Return the facts of the first trial, and of those after it that its node could go on with."""
        worker, plan = self._worker(), plans[0]
        files = [self._folder.resolve() / f"{each.name}.json" for each in plans]
        for file in files:
            file.unlink(missing_ok=True)
        try:
            # None twice in a row: the participants of an ended trial stay on their domain's graph for a while.
            with dds_domain.free(after=worker.domain) as worker.domain:
                request = self._request(
                    trial=plan.name, domain_id=worker.domain, out=str(files[0]), patience_s=self.patience_s(plan),
                    then=[each.name for each in plans[1:]], case=plan.case,
                )  # fmt: skip
                answer, out_of_time = _ask(worker.process, request)
        except BaseException:
            _end(worker.process)
            raise
        if answer.startswith(CANNOT):
            _end(worker.process)
            raise GraderError(answer.removeprefix(CANNOT))
        answered = answer == plan.name
        if answered:
            self._idle.append(worker)
        ended_by_itself = answered or _end(worker.process)
        written = itertools.takewhile(Path.is_file, files)
        if found := [evidence.from_json(file.read_text(), evidence.Trial) for file in written]:
            return found  # the worker may have died after the last of them
        status = worker.process.returncode
        if status in _KILLED and ended_by_itself and not out_of_time:
            raise GraderError(say(shortage.KILLED))
        if status in _CRASHED:
            if not has_crashed:
                return self._observed(plans, has_crashed=True)
            # One crash may be chance, so retry once; a submission that crashes the observer every time scores nothing.
            return [not_started(plan, self._seed, ended=Reason(Kind.OBSERVER_CRASHED))]
        return [not_started(plan, self._seed, f"the trial's worker ended (answer {answer!r}, status {status})")]


def jobs(observers: Observers, plans: Iterable[TrialPlan]) -> list[tuple[TrialPlan, Job[evidence.Trial]]]:
    """Return the trials with their jobs, in the order in which they keep the cores busiest.

    A trial that follows another one has run when the job of that one has ended.
    """
    found = []
    groups = {group[0].name: group for group in of_one_node(list(plans))}
    for first in _mixed([group[0] for group in groups.values()]):
        others = groups[first.name][1:]
        turn = Turn.BESIDE if first.real_time or first.mostly_waits else Turn.CORE
        found.append((first, Job(
            job_name(first.name), Where.NETWORK, evidence.Trial, partial(observers.run, first, others),
            turn=turn, says=_says(first),
        )))  # fmt: skip
        for plan in others:
            found.append((plan, Job(
                job_name(plan.name), Where.NETWORK, evidence.Trial, partial(observers.follower, plan),
                after=job_name(plan.follows), says=_says(plan),
            )))  # fmt: skip
    return found


def _says(plan: TrialPlan) -> str:
    return f"trial {plan.name}: {plan.sentence}"


def of_one_node(plans: Sequence[TrialPlan]) -> list[list[TrialPlan]]:
    """Return the trials in groups, each of which one node goes through as long as it comes to rest between them."""
    names, after = {plan.name for plan in plans}, dict[str, TrialPlan]()
    for plan in plans:
        if plan.follows in names:
            after.setdefault(plan.follows, plan)
    later = {plan.name for plan in after.values()}
    groups = [[plan] for plan in plans if plan.name not in later]
    for group in groups:
        while following := after.get(group[-1].name):
            group.append(following)
    return groups


def job_name(trial: str) -> str:
    """Return the name of a trial's job."""
    return f"trial {trial}"


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


def _environment(contract: Path, folder: Path) -> dict[str, str]:
    home = folder / "worker-home"
    home.mkdir(parents=True, exist_ok=True)
    return observer_environment(contract, home=home) | namespaces.inherited()


def observer_environment(contract: Path, *, home: Path) -> dict[str, str]:
    """Return the environment for a process that observes nodes; the contract's interfaces come first on its path."""
    return ros_env.environment(contract, home=home) | {"FASTRTPS_DEFAULT_PROFILES_FILE": str(_DISCOVERY)}


def _end(process: subprocess.Popen[str]) -> bool:
    """End a worker process; return False if it had to be killed."""
    assert process.stdin is not None
    assert process.stdout is not None
    with contextlib.suppress(BrokenPipeError):
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
    waiting = select.poll()  # unlike select(), with any number of open files
    waiting.register(process.stdout, select.POLLIN)
    with contextlib.suppress(OSError):
        process.stdin.write(json.dumps(asdict(request)) + "\n")
        process.stdin.flush()
        if not waiting.poll(_TRIAL_CAP_S * 1000):
            process.kill()
            return "", True
        return process.stdout.readline().strip(), False
    return "", False
