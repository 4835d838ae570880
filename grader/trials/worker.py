"""The trusted process that runs trials, inside a network namespace of its own. One request line in, one answer out.

Its standard input brings one JSON object a trial; it writes the evidence file and answers with the trial's name. The
node under trial sits behind a wall of its own inside the same network; nothing of this process is visible to it.
"""

from __future__ import annotations

import json
import math
import os
import random
import sys
import time
import traceback
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import build, evidence, sandbox
from grader.contract import spec
from grader.errors import GraderError
from grader.host import ros_env, shortage
from grader.trials import catalog, parameter_files, wire_layout
from grader.trials.interfaces import SensorFusionData
from grader.trials.observation import TrialOver
from grader.trials.request import CANNOT, LATE_VARIABLE, READY, Request, unjudged
from grader.trials.stage import SOURCE, Stage
from sim import Simulator, World, load_world


def main() -> int:
    """Run the trials that standard input asks for."""
    plans = catalog.trials()
    print(READY, flush=True)
    for line in sys.stdin:
        request = Request(**json.loads(line))
        plan = plans[request.trial]
        try:
            run_trial(plan, request)
        except Exception as error:  # the one place where a fault of ours must not take the other trials along
            if Path(request.out).is_file():  # the trial was over; a process that cannot leave the graph begins no other
                traceback.print_exc()
                return 1
            if said := _of_this_machine(error):
                print(CANNOT + said, flush=True)
                continue
            _keep(request, unjudged(plan, request.seed, traceback.format_exc()))
        print(request.trial, flush=True)
    return 0


def _of_this_machine(error: Exception) -> str:
    """Return in one line why this machine can run no trial now, "" for any other error."""
    return " ".join((str(error) if isinstance(error, GraderError) else shortage.explain(error)).split())


def _keep(request: Request, facts: evidence.Trial) -> None:
    """Write the facts, whole or not at all: who asked for them believes the file even if this process ends badly."""
    part = Path(f"{request.out}.part")
    part.write_text(evidence.to_json(facts))
    part.replace(request.out)


def run_trial(plan: catalog.TrialPlan, request: Request) -> None:
    """Start the node behind its wall, play the trial's script, keep what was seen, and leave the graph."""
    install = Path(request.install)
    missing = _missing(plan, install)
    if missing:
        _keep(request, unjudged(plan, request.seed, "", ended=missing))
        return
    simulator = Simulator(_variant(plan, request.seed), seed=request.seed)
    box = _wall(install, request)
    telltales: dict[str, float] = {}
    if plan.launch or plan.params_file:
        names = plan.params_file or "*.yaml"
        copies, telltales = parameter_files.changed(_share(install) / "config", Path(f"{request.out}.config"), names)
        files = {copy: f"{_share(build.INSTALL)}/config/{name}" for copy, name in copies.items()}
        tools = {_ROS2: "/ws/ros2", _LAUNCH: "/ws/launch"} if plan.launch else {}
        box = replace(box, read_only={**box.read_only, **files, **tools})
    with ExitStack() as others, sandbox.Process(_command(plan), box, _LIMITS) as process:
        time.sleep(float(os.environ.get(LATE_VARIABLE, "0")))
        stage = Stage(plan, request.seed, simulator, process, request.domain_id)
        stage.start = lambda command: others.enter_context(sandbox.Process(command, box, _LIMITS))
        stage.readers = _readers(install)
        for name, remappings in plan.beside.items():
            stage.others[name] = stage.start(_start(name) + _remap(remappings))
        stage.choices.update(telltales)
        ended = script_error = ""
        try:
            stage.open()
            plan.script(stage)
        except TrialOver as over:
            ended = str(over)
        except Exception as error:
            if _of_this_machine(error):
                raise
            script_error = traceback.format_exc()
        _keep(request, stage.facts(ended, script_error))  # first: Fast DDS has been seen to crash on leaving
        stage.close()


def _readers(install: Path) -> dict[str, wire_layout.Read]:
    """Return by topic how to read the messages of a type that the submission has laid out in its own way."""
    text = build.interface_text(install / "share", "msg/SensorFusionData")
    read = wire_layout.reader(text, SensorFusionData)
    return {"sensor_fusion_data": read} if read else {}


def _missing(plan: catalog.TrialPlan, install: Path) -> str:
    """Return what the trial needs and the package has not installed, in words, "" if it is all there."""
    if plan.launch and plan.launch != catalog.OWN_LAUNCH:
        there = (_share(install) / "launch" / plan.launch).is_file()
        return "" if there else f"there is no launch/{plan.launch} in share/{spec.PACKAGE}"
    there = (install / "lib" / spec.PACKAGE / plan.node).is_file()
    return "" if there else f"there is no executable {plan.node} in lib/{spec.PACKAGE}"


def _share(install: Path) -> Path:
    return install / "share" / spec.PACKAGE


# The `ros2` command and our own launch files; each is mounted alone, so that nothing else of the kit is in sight.
_ROS2 = Path(__file__).parents[1] / "ros2"
_LAUNCH = Path(__file__).parent / "launch"


def _variant(plan: catalog.TrialPlan, seed: int) -> World:
    """Return the trial's world turned, mirrored and shifted by the seed: no place in it is worth learning by heart."""
    chance = random.Random(f"{seed}:{plan.name}:world")
    return load_world(plan.world).transformed(
        rotate=chance.uniform(-math.pi, math.pi),
        mirror=chance.random() < 0.5,
        shift=(chance.uniform(-5.0, 5.0), chance.uniform(-5.0, 5.0)),
    )


# Two nodes and a launch file take 0.3 GB.
_LIMITS = sandbox.Limits(wall_seconds=300.0, resident_bytes=1536 * sandbox.MIB)


def _wall(install: Path, request: Request) -> sandbox.Sandbox:
    environment = ros_env.environment(build.INSTALL, home=sandbox.HOME)
    source = {Path(request.package): str(SOURCE)} if request.package else {}
    return sandbox.Sandbox(
        read_only={install: str(build.INSTALL), **source},
        environment=environment | {"ROS_DOMAIN_ID": str(request.domain_id)},
        network=True,
    )


def _command(plan: catalog.TrialPlan) -> list[str]:
    if plan.launch:
        own = plan.launch == catalog.OWN_LAUNCH
        file = f"/ws/launch/{plan.launch}" if own else f"{_share(build.INSTALL)}/launch/{plan.launch}"
        return ["python3", "/ws/ros2", "launch", file, f"use_sim_time:={_parameter(plan.use_sim_time)}"]
    command = _start(plan.node) + _remap(plan.remappings)
    if plan.params_file:
        command += ["--params-file", f"{build.INSTALL}/share/{spec.PACKAGE}/config/{plan.params_file}"]
    for name, value in plan.parameters.items():
        command += ["-p", f"{name}:={_parameter(value)}"]
    return command


def _start(executable: str) -> list[str]:
    return [f"{build.INSTALL}/lib/{spec.PACKAGE}/{executable}", "--ros-args", "-p", "use_sim_time:=true"]


def _remap(remappings: Mapping[str, str]) -> list[str]:
    return [word for name, new in remappings.items() for word in ("-r", f"{name}:={new}")]


def _parameter(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


if __name__ == "__main__":
    sys.exit(main())
