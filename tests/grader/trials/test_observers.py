"""A worker process that dies costs its own trial at most, and nothing if this machine killed it."""

from __future__ import annotations

import itertools
import json
import math
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from helpers import ros2_runs
from helpers.course import COURSE
from helpers.short_nodes import COMMANDS, install_node, run_trials

from grader import KIT, building, evidence, pipeline
from grader.errors import GraderError
from grader.evidence import Kind, Reason
from grader.host import procfs, ros_env
from grader.trials import catalog, observers
from grader.trials.node_under_test import NodeUnderTest, TrialOver
from grader.trials.observers import Observers
from grader.trials.plan import TrialPlan
from grader.trials.request import BEHIND_S, PATIENCE_S, not_started
from grader.trials.source import integrity_flags
from sim import Pose, Simulator

PLAN = TrialPlan("any", "", lambda _stage: None)
AS_SEEN = Reason(Kind.SLOW, seconds=1.0)


@pytest.fixture
def run_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], evidence.Trial]:
    """Run PLAN with a shell command as the worker, after it has read the request. Return the trial's facts."""

    def run(command: str, plan: TrialPlan = PLAN) -> evidence.Trial:
        shell = ["sh", "-c", f"read line; {command}"]
        pipe = subprocess.PIPE
        monkeypatch.setattr(
            observers,
            "start_worker",
            lambda *_: subprocess.Popen(shell, stdin=pipe, stdout=pipe, text=True, cwd=tmp_path),
        )
        return run_trials([plan], install=tmp_path, contract=tmp_path, folder=tmp_path, seed=0)["any"]

    return run


@pytest.fixture
def observed(tmp_path: Path) -> Path:
    """An evidence file, as a worker writes it."""
    file = tmp_path / "observed"
    file.write_text(evidence.to_json(not_started(PLAN, 0, ended=AS_SEEN)))
    return file


@pytest.mark.parametrize("ending", ["kill -9 $$", "exit 137"], ids=["bubblewrap", "the worker in it"])
def test_a_worker_killed_by_the_kernel_is_an_error_of_the_grader(run_with, ending: str):
    with pytest.raises(GraderError, match="killed from outside, as the kernel does when memory runs out"):
        run_with(ending)


def test_a_worker_that_answers_nonsense_is_not_taken_for_killed_by_the_kernel(run_with, monkeypatch):
    """It is ended by ours, and costs that trial only."""
    monkeypatch.setattr(observers, "_STOP_S", 0.1)
    assert "answer 'nonsense'" in run_with("echo nonsense; sleep 60").script_error


def test_a_worker_that_exits_with_an_error_costs_that_trial_only(run_with):
    assert "the trial's worker ended" in run_with("exit 1").script_error


@pytest.mark.parametrize("ending", ["kill -SEGV $$", "exit 139"])
def test_a_trial_whose_worker_crashes_is_tried_again(run_with, observed: Path, ending: str):
    """Once may be chance; after the second crash the trial scores nothing, and a flag tells the instructor."""
    crashed = f"{observed}-once"
    second = f"if [ -e {crashed} ]; then cp {observed} any.json; echo any; read line; fi; touch {crashed}"
    assert run_with(f"{second}; {ending}").ended == AS_SEEN
    always = run_with(ending)
    assert (always.ended, always.script_error) == (Reason(Kind.OBSERVER_CRASHED), "")
    assert [flag.kind for flag in integrity_flags({"any": always})] == ["observer"]


def test_a_worker_that_crashes_after_the_trial_costs_nothing(run_with, observed: Path):
    found = run_with(f"cp {observed} any.json; kill -SEGV $$")
    assert (found.ended, found.script_error) == (AS_SEEN, "")


def test_long_trials_begin_first_and_those_of_a_file_are_spread_evenly():
    def of(file: str) -> Callable[[object], None]:
        def script(_stage: object) -> None: ...

        script.__module__ = file
        return script

    names = {"a": "speed", "b": "speed", "c": "speed", "d": "speed", "e": "goals", "f": "goals"}
    plans = [TrialPlan(name, "", of(file), takes_long=name == "d") for name, file in names.items()]
    assert "".join(plan.name for plan in observers._mixed(plans)) == "daebcf"


def test_a_node_that_never_comes_up_is_not_waited_for_in_full_each_time(tmp_path: Path):
    """A package whose nodes never came up once took 262 s. Two trials tell; the others wait less, and still run."""
    absent = not_started(PLAN, 0, ended=Reason(Kind.NOT_UP, "x", seconds=20.0))
    refusing = not_started(PLAN, 0, ended=Reason(Kind.DIED_EARLY, exit_code=1))
    trials = Observers(COURSE, install=tmp_path, contract=tmp_path, folder=tmp_path, seed=0)
    waited = []
    for found in (refusing, refusing, absent, absent):
        waited.append(trials.patience_s(PLAN))
        trials._found.append(found)
    assert [*waited, trials.patience_s(PLAN)] == [PATIENCE_S] * 4 + [observers.SHORT_PATIENCE_S]
    assert trials.patience_s(replace(PLAN, node="sensor_processor")) == PATIENCE_S
    assert trials.patience_s(replace(PLAN, launch="robot_controller_launch.py")) == PATIENCE_S
    trials._found.append(replace(absent, ready=True, ended=None))
    assert trials.patience_s(PLAN) == PATIENCE_S


def test_the_trials_of_the_course_are_at_most_36_lives():
    groups = observers.of_one_node(list(catalog.trials(COURSE).values()))
    assert len(groups) <= 36
    names = [plan.name for group in groups for plan in group]
    assert sorted(names) == sorted(catalog.trials(COURSE))
    assert all(plan.follows == before.name for group in groups for before, plan in itertools.pairwise(group))


def test_a_trial_whose_predecessor_is_not_wanted_starts_a_life():
    plans = [catalog.trials(COURSE)[name] for name in ("refuse_speed", "drive_forward")]
    lives = [[plan.name for plan in group] for group in observers.of_one_node(plans)]
    assert lives == [["refuse_speed"], ["drive_forward"]]


@pytest.mark.parametrize(("goes_on", "lives"), [("a b c", 1), ("a b", 2), ("a", 3)])
def test_a_trial_that_its_node_could_not_go_on_with_has_another_node(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, goes_on: str, lives: int
):
    """The worker answers with the evidence of those trials with which the node of the first went on."""
    plans = [replace(PLAN, name=name, follows=before) for name, before in zip("abc", ["", "a", "b"], strict=True)]
    for plan in plans:
        (tmp_path / f"seen_{plan.name}").write_text(evidence.to_json(not_started(plan, 0, ended=AS_SEEN)))
    first = r's/.*"trial": "\([a-c]\)".*/\1/'
    each = f"echo >> asked; name=$(echo \"$line\" | sed '{first}')"
    written = f"for n in {goes_on}; do [ $(wc -l < asked) = 1 ] && cp seen_$n $n.json; done; cp seen_$name $name.json"
    shell = ["sh", "-c", f"while read line; do {each}; {written}; echo $name; done"]
    start = partial(subprocess.Popen, shell, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    monkeypatch.setattr(observers, "start_worker", lambda *_: start())
    found = run_trials(plans, install=tmp_path, contract=tmp_path, folder=tmp_path, seed=0)
    assert [trial.name for trial in found.values()] == ["a", "b", "c"]
    assert len((tmp_path / "asked").read_text()) == lives


@pytest.mark.parametrize(
    "wrong",
    [
        {"ended": AS_SEEN},
        {"script_error": "Traceback"},
        {"pace": "real time"},
        {"parameters": [evidence.ParameterAnswer(0.1, "rate", 5.0, accepted=True, value=5.0)]},
        {"goals": [evidence.Goal(0.1, 1.0, 0.0, 0.1, True, "unfinished", None, math.nan, math.nan, math.nan)]},
    ],
    ids=lambda wrong: next(iter(wrong)),
)
def test_a_node_does_not_go_on_after_a_trial_that_may_show_later(wrong: dict[str, Any]):
    from grader.trials.worker import _ended_well

    runs, over = (cast("Any", SimpleNamespace(has_ended=lambda ended=ended: ended)) for ended in (False, True))
    trial = replace(not_started(PLAN, 0), ready=True)
    assert _ended_well(trial, runs)
    assert not _ended_well(replace(trial, **wrong), runs)
    assert not _ended_well(trial, over)


def test_the_next_world_is_put_around_the_robot():
    from grader.trials.worker import _transformed_world

    plan, pose = catalog.trials(COURSE)["wall_slow"], Pose(3.0, -2.0, 0.5)
    world, usual = _transformed_world(COURSE, plan, 7, pose), _transformed_world(COURSE, plan, 7)
    assert (world.start.x, world.start.y, world.start.yaw) == pytest.approx((3.0, -2.0, 0.5))
    ranges = [Simulator(each, seed=7).true_ranges() for each in (world, usual)]
    assert ranges[0] == pytest.approx(ranges[1])


NOTES_ITS_START = 'print("started", flush=True)\n'
COMES_TO_NO_REST = """
def set_speed(request, response):
    response.success = True
    return response
node.create_service(SetSpeed, "set_speed", set_speed)
"""


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.parametrize(
    ("names", "starts"),
    [(("idle_robot_controller", "interrupted_robot_controller"), 1), (("drive_forward", "drive_backward"), 2)],
    ids=["goes on", "does not drive"],
)
def test_a_node_goes_on_only_if_it_comes_to_rest(contract: building.Built, tmp_path: Path, names: Any, starts: int):
    """What the first trial has said is not in the second one's output; a node that drives nowhere starts afresh."""
    install = install_node(contract, tmp_path, "robot_controller", COMMANDS + COMES_TO_NO_REST + NOTES_ITS_START)
    plans = [catalog.trials(COURSE)[name] for name in names]
    found = run_trials(plans, install=install, contract=contract.install, folder=tmp_path / "trials", seed=1)
    outputs = [found[name].process.output_tail for name in names]
    assert [output.count("started") for output in outputs] == [1, 1][:starts] + [0] * (2 - starts)
    assert all(trial.samples[0].t == 0.0 and trial.commands[0].t < 1.0 for trial in found.values())


ABOUT_ITS_HOST = """#!/usr/bin/env python3
import json, os, resource
limits = {name: resource.getrlimit(getattr(resource, name)) for name in dir(resource) if name.startswith("RLIMIT")}
del limits["RLIMIT_OFILE"]  # another name of RLIMIT_NOFILE
cores = sorted(os.sched_getaffinity(0)), os.cpu_count()
turns = os.nice(0), os.sched_getscheduler(0)
found = {"cores": cores, "turns": turns, "limits": limits, "environment": dict(os.environ)}
print(json.dumps(found), flush=True)
"""


@pytest.mark.ros
@pytest.mark.sandbox
def test_a_node_sees_its_host_as_with_ros2_run_but_for_what_is_listed(
    reference: Path, contract: building.Built, settings: pipeline.Settings, tmp_path: Path
):
    """It saw one core: a MultiThreadedExecutor made one thread there, and a callback that waits hung for good."""
    built = building.build([reference], settings.cache, COURSE)
    install = shutil.copytree(built.install, tmp_path / "install", symlinks=True)
    (install / "lib" / reference.name / "robot_controller").write_text(ABOUT_ITS_HOST)
    command = [sys.executable, str(ros2_runs.COMMAND), "run", reference.name, "robot_controller"]
    sourced = {"PATH": f"{sys.prefix}/bin:/usr/bin:/bin", "HOME": str(tmp_path), "LANG": "C.UTF-8"}
    sourced |= {"AMENT_PREFIX_PATH": str(install), "PYTHONPATH": str(install / ros_env.SITE_IN_PREFIX)}
    run = subprocess.run(command, env=sourced, capture_output=True, text=True, check=True)
    plain = about_its_host(run.stdout)
    plans = [catalog.trials(COURSE)[name] for name in ("creeping", "launch_robot_controller")]
    found = run_trials(plans, install=install, contract=contract.install, folder=tmp_path / "out", seed=1)
    for trial in found.values():
        assert trial.process is not None
        seen = about_its_host(trial.process.output_tail)
        assert (seen["cores"], seen["turns"]) == (plain["cores"], plain["turns"])
        limits = {name for name, limit in seen["limits"].items() if limit != plain["limits"][name]}
        variables = seen["environment"].keys() ^ plain["environment"].keys()
        assert limits | variables <= set(re.findall("`([A-Z_]+)`", LISTED))


LISTED = (KIT / "docs" / "trials.md").read_text().partition("What a trial changes")[2].partition("\n\n")[0]


def about_its_host(output: str) -> dict[str, Any]:
    """Return what a program has said of its host; a launch file puts the node's name before that."""
    line = next(line for line in output.splitlines() if '{"cores"' in line)
    found: dict[str, Any] = json.loads(line[line.index("{") :])
    return found


CRASHES_ON_CLOSE = """
import os, signal
import sim.bridge
sim.bridge.Bridge.close = lambda self: os.kill(os.getpid(), signal.SIGSEGV)
"""


@pytest.mark.slow  # a node more
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_crash_on_leaving_the_graph_loses_no_trial(
    reference: Path,
    contract: building.Built,
    settings: pipeline.Settings,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
):
    """Fast DDS has been seen to crash there. The evidence is saved before, and the next trial gets another worker."""
    (tmp_path / "sitecustomize.py").write_text(CRASHES_ON_CLOSE)
    usual = observers.observer_environment

    def environment(contract: Path, *, home: Path) -> dict[str, str]:
        found = usual(contract, home=home)
        return found | {"PYTHONPATH": f"{tmp_path}:{KIT}:{found['PYTHONPATH']}"}

    monkeypatch.setattr(observers, "observer_environment", environment)
    plans = [catalog.trials(COURSE)[name] for name in ("idle_robot_controller", "idle_sensor_processor")]
    built = building.build([reference], settings.cache, COURSE)
    found = run_trials(plans, install=built.install, contract=contract.install, folder=tmp_path, seed=1)
    assert [(trial.ready, trial.script_error) for trial in found.values()] == [(True, ""), (True, "")]


@pytest.mark.ros
@pytest.mark.sandbox
def test_workers_share_no_network_with_each_other_or_with_us(contract: building.Built, tmp_path: Path):
    environment = observers._environment(contract.install, tmp_path)
    start = partial(observers.start_worker, COURSE, environment, tmp_path)
    with start("first") as first, start("second") as second:
        inside = [procfs.descendants(worker.pid)[-1] for worker in (first, second)]
        assert len({Path(f"/proc/{pid}/ns/net").readlink() for pid in (*inside, "self")}) == 3
        devices = Path(f"/proc/{inside[0]}/net/dev").read_text().splitlines()[2:]
        assert [line.split(":")[0].strip() for line in devices] == ["lo"]
        for worker in (first, second):
            assert worker.communicate() == ("", None)  # closes its standard input: there are no more requests
    assert (first.returncode, second.returncode) == (0, 0)


def test_what_keeps_a_worker_from_starting_is_told(tmp_path: Path):
    (tmp_path / "sitecustomize.py").write_text("raise SystemExit('no such luck')")
    with pytest.raises(GraderError, match=r"(?s)The trial worker did not start:.*no such luck.*Run `grader doctor`\."):
        observers.start_worker(COURSE, {**os.environ, "PYTHONPATH": str(tmp_path)}, tmp_path, "any")


# -- a node that waits by itself ---------------------------------------------------------------------------------------


def waiting_node(pace: str, waits_s: float) -> NodeUnderTest:
    """Return a node whose callbacks wait for so long in each tick of a simulated tenth of a second."""
    node: Any = object.__new__(NodeUnderTest)
    bridge = SimpleNamespace(time=0.0, pace=pace, can_ask=False, heard=0)
    clock: Any = SimpleNamespace(idle=0.0, seconds=lambda: clock.idle, read=lambda: clock.idle)

    def tick(dt: float, further_rounds: int) -> None:
        bridge.time += dt
        clock.idle += waits_s

    bridge.tick = tick
    node.bridge, node._clock = bridge, clock
    node.process = SimpleNamespace(exit_code=lambda: None, abort=lambda: None, output="")
    node.process.exit_code = lambda: -6 if node.aborted else None
    node.aborted, node._one_thread, node._work_limit_s, node._deaf_s, node._waited_s = False, False, 120.0, 0.0, 0.0
    return node


def test_a_node_whose_callbacks_wait_for_a_second_each_does_not_take_a_short_trial_two_minutes():
    node = waiting_node("lockstep", 1.0)
    for _ in range(33):
        node.tick(0.1, ending=False)
    with pytest.raises(TrialOver) as over:
        node.tick(0.1, ending=False)
    assert over.value.reason == Reason(Kind.WAITS, seconds=BEHIND_S)
    assert node.aborted


@pytest.mark.parametrize(("pace", "waits_s"), [("lockstep", 0.1), ("lockstep", 0.6), ("real time", 0.1)])
def test_a_node_that_keeps_up_with_a_robot_or_nearly_is_not_cut_off(pace: str, waits_s: float):
    """In real time each tick waits for as long as it is."""
    node = waiting_node(pace, waits_s)
    for _ in range(50):
        node.tick(0.1, ending=False)


def test_a_submission_that_has_waited_in_all_trials_so_far_gets_no_more(run_with, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(observers, "ALL_BEHIND_S", -1.0)
    assert run_with("echo must not be asked").ended == Reason(Kind.WAITED, seconds=-1.0)
