"""The facts that a grading leaves, and their JSON. Facts only: whether they are good is for the checks to say.

On disk a grading's evidence is one folder:

    submission.json     Intake: what was handed in, which package was chosen
    build.json          Build: how the build went and what it installed
    tests.json          OwnTests: the package's own tests and their coverage
    mutation.json       Mutation: faults put into the package, and which tests noticed
    quality.json        Quality: what the package's text shows, read and never run
    trials/NAME.json    Trial: one run of one node in a world
    flags.json          list of Flag: attempts at tampering and other oddities
    conversions.json    list of FunctionAnswer: what utils/conversions.py returned
    origin.json         what made it: seed, versions and hashes, so that an appeal is a re-run

Times `t` are simulated seconds since the trial began, unless the name says wall.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import cattrs

T = TypeVar("T")


@dataclass(frozen=True)
class Flag:
    """Something an instructor should look at: an attempt at tampering, or a wall that was missing."""

    kind: str
    what: str
    where: str = ""


@dataclass(frozen=True)
class Intake:
    """What was handed in. Paths are relative to the unpacked submission."""

    name: str
    sha256: str
    package: str
    package_path: str
    files: list[str] = field(default_factory=list)
    others: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    interfaces_package: str = ""


@dataclass(frozen=True)
class Build:
    """How `colcon build` went, and what it installed. `type_hashes` maps "srv/SetSpeed" to its RIHS01 hash."""

    ok: bool
    cached: bool
    wall_seconds: float
    exit_code: int | None
    timed_out: bool
    log_tail: str
    executables: list[str] = field(default_factory=list)
    shared_files: list[str] = field(default_factory=list)
    type_hashes: dict[str, str] = field(default_factory=dict)
    interface_texts: dict[str, str] = field(default_factory=dict)
    contract_hashes: dict[str, str] = field(default_factory=dict)
    contract_texts: dict[str, str] = field(default_factory=dict)
    stopped: str = ""
    """The limit of the whole wall that the build met: "memory", "processes", "disk" or ""."""
    flags: list[Flag] = field(default_factory=list)
    """What the build left behind that an instructor should look at."""


@dataclass(frozen=True)
class TestModule:
    """One test module of the package, as read (not run) and as run in a process of its own."""

    path: str
    stub: bool
    tests: int
    asserting: int
    subjects: list[str]
    silent: list[str] = field(default_factory=list)
    """The tests that assert nothing."""
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    errors: int = 0
    timed_out: bool = False
    failures: list[str] = field(default_factory=list)
    unsteady: list[str] = field(default_factory=list)
    """The tests that failed, and passed when the module was run again: they count as passed."""
    output_tail: str = ""


@dataclass(frozen=True)
class FileCoverage:
    """Lines and branches of one source file that the package's own tests reached."""

    path: str
    lines: int
    lines_hit: int
    branches: int
    branches_hit: int
    missing: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class OwnTests:
    """The package's own tests: the modules, and what they cover of the package."""

    modules: list[TestModule] = field(default_factory=list)
    coverage: list[FileCoverage] = field(default_factory=list)
    note: str = ""
    doubts: list[str] = field(default_factory=list)
    """What the reports said in runs whose result was known beforehand, and should not have."""


@dataclass(frozen=True)
class Fault:
    """One fault put into the package's source. `outcome` is "noticed", "unnoticed", "unreached" or "not tried"."""

    path: str
    line: int
    function: str
    operator: str
    words: str
    outcome: str
    by: str = ""
    """The test that noticed it, "" for none."""
    late: bool = False
    """Whether it was noticed because a test came to no end."""
    tried: list[str] = field(default_factory=list)
    """For a fault that no test noticed: the tests that reached it and passed."""


def short_name(test: str) -> str:
    """Return "test_it[a]" for the test "test/test_x.py::TestIt::test_it[a]"."""
    head, bracket, rest = test.partition("[")
    return head.rpartition("::")[2] + bracket + rest


@dataclass(frozen=True)
class Decoy:
    """One change that keeps the behaviour, and the tests that failed all the same."""

    path: str
    line: int
    words: str
    tests: int
    failed: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Mutation:
    """Faults put into the package's source, and whether its own tests noticed. `possible` counts all there could be."""

    seed: int
    possible: int
    faults: list[Fault] = field(default_factory=list)
    decoys: list[Decoy] = field(default_factory=list)
    set_aside: list[str] = field(default_factory=list)
    """Tests whose results did not repeat; what they noticed does not count."""
    convicted: list[str] = field(default_factory=list)
    """Tests that failed, again and again, on changes that keep the behaviour."""
    wall_seconds: float = 0.0
    quiet_seconds: float = 0.0
    """What the runs would have taken by the clock if nothing else had been going on; the budget is held against it."""
    budget_seconds: float = 0.0
    note: str = ""


@dataclass(frozen=True)
class Finding:
    """A place in the package's text that a rule speaks of. `path` is relative to the package."""

    path: str
    line: int
    rule: str
    text: str


@dataclass(frozen=True)
class SourceFile:
    """One Python file: its lines of code (neither blank nor comment), and why it could not be read, if so."""

    path: str
    lines: int
    problem: str = ""


@dataclass(frozen=True)
class Definition:
    """A public module, class or function, what is missing in its annotations, and what its docstring breaks."""

    path: str
    line: int
    kind: str
    name: str
    documented: bool
    unannotated: list[str] = field(default_factory=list)
    faults: list[Finding] = field(default_factory=list)


@dataclass(frozen=True)
class Copy:
    """The same `lines` lines of code in several places, each as "path:first-last"."""

    lines: int
    places: list[str]


@dataclass(frozen=True)
class Conversions:
    """The functions that utils/conversions.py defines, where the nodes call them, and conversions made elsewhere."""

    defined: list[str] = field(default_factory=list)
    calls: list[Finding] = field(default_factory=list)
    elsewhere: list[Finding] = field(default_factory=list)


@dataclass(frozen=True)
class ParameterUse:
    """Whether the code declares a parameter of the contract and reads it; places where its default stands instead."""

    node: str
    name: str
    declared: bool
    read: bool
    literals: list[Finding] = field(default_factory=list)


@dataclass(frozen=True)
class CodeInterface:
    """An interface that the code creates under a literal name. `kind` is "publisher", "service" and so on."""

    node: str
    kind: str
    name: str
    type: str


@dataclass(frozen=True)
class Table:
    """A table of a Markdown file: the cells of its head and of its rows."""

    head: list[str]
    rows: list[list[str]]


@dataclass(frozen=True)
class Readme:
    """The README: its words of prose, which of "build", "run", "test" it shows a command for, and its tables."""

    path: str
    words: int
    placeholders: list[Finding] = field(default_factory=list)
    shows: dict[str, str] = field(default_factory=dict)
    tables: list[Table] = field(default_factory=list)


@dataclass(frozen=True)
class TestReport:
    """test_results.xml: its cases as "module::name", and why it is no junit report, if so."""

    path: str
    problem: str = ""
    cases: list[str] = field(default_factory=list)
    failed: int = 0


@dataclass(frozen=True)
class Manifest:
    """package.xml, and what the package really has and uses: package name -> places that use it."""

    found: bool
    problems: list[str] = field(default_factory=list)
    format: str = ""
    maintainers: list[str] = field(default_factory=list)
    licences: list[str] = field(default_factory=list)
    spdx: list[bool] = field(default_factory=list)
    build_type: str = ""
    has_cmake: bool = False
    generates_interfaces: bool = False
    declared: list[str] = field(default_factory=list)
    declared_to_run: list[str] = field(default_factory=list)
    """Those of them that are there not only for tests and documentation."""
    used: dict[str, list[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Quality:
    """What the package's text shows. `style` is ament_flake8's, with suppressions taken out of force."""

    manifest: Manifest
    paths: list[str] = field(default_factory=list)
    files: list[SourceFile] = field(default_factory=list)
    style: list[Finding] = field(default_factory=list)
    style_count: int = 0
    suppressions: list[Finding] = field(default_factory=list)
    definitions: list[Definition] = field(default_factory=list)
    complex: list[Finding] = field(default_factory=list)
    copies: list[Copy] = field(default_factory=list)
    habits: list[Finding] = field(default_factory=list)
    conversions: Conversions = field(default_factory=Conversions)
    parameters: list[ParameterUse] = field(default_factory=list)
    interfaces: list[CodeInterface] = field(default_factory=list)
    readme: Readme | None = None
    report: TestReport | None = None
    tests: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Command:
    """One `cmd_vel` message that arrived: linear x in m/s, angular z in rad/s, and the largest other component."""

    t: float
    v: float
    omega: float
    other: float = 0.0


@dataclass(frozen=True)
class Sample:
    """The robot's true state and its odometry after one tick. Poses in the odom frame, m and rad."""

    t: float
    x: float
    y: float
    yaw: float
    v: float
    omega: float
    odom_x: float
    odom_y: float
    odom_yaw: float
    clearance: float


@dataclass(frozen=True)
class ScanSummary:
    """One published scan: the closest valid reading in each sector of 120 degrees, and anywhere; inf if none."""

    t: float
    ahead: float
    behind: float
    anywhere: float


@dataclass(frozen=True)
class Touch:
    """The hull touched an obstacle."""

    t: float
    obstacle: str
    speed: float


@dataclass(frozen=True)
class Call:
    """One service call. `response` is None when no answer came; then `problem` says what happened."""

    t: float
    service: str
    request: dict[str, Any]
    response: dict[str, Any] | None
    answered_t: float = math.nan
    problem: str = ""


@dataclass(frozen=True)
class Goal:
    """One goal of the action. `status` is "succeeded", "canceled", "aborted", "rejected" or "unfinished"."""

    t: float
    x: float
    y: float
    tolerance: float
    accepted: bool
    status: str
    success: bool | None
    final_x: float
    final_y: float
    ended_t: float
    cancel_t: float = math.nan
    cancel_accepted: bool | None = None
    feedback: list[list[float]] = field(default_factory=list)
    problem: str = ""


@dataclass(frozen=True)
class Endpoint:
    """One publisher or subscription on the graph. `reliability` is "reliable" or "best_effort"."""

    topic: str
    kind: str
    node: str
    type: str
    type_hash: str
    reliability: str


@dataclass(frozen=True)
class Graph:
    """What the running graph shows of one node. Names carry no leading slash."""

    nodes: list[str] = field(default_factory=list)
    endpoints: list[Endpoint] = field(default_factory=list)
    services: dict[str, list[str]] = field(default_factory=dict)
    actions: dict[str, list[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class ProcessEnd:
    """How a node's process ended. `by` is "itself", "us" (stopped after the trial) or "interrupt" (asked by SIGINT)."""

    by: str
    exit_code: int | None
    wall_seconds: float
    output_tail: str


@dataclass(frozen=True)
class Message:
    """One message of a topic that the trial listened to, its fields flattened to plain values."""

    t: float
    topic: str
    data: dict[str, Any]


@dataclass(frozen=True)
class ParameterAnswer:
    """A parameter that was asked for or set on the running node. `value` is what the node says it is afterwards."""

    t: float
    name: str
    wanted: Any = None
    accepted: bool | None = None
    """Whether the node accepted `wanted`; None if nothing was to be set, or no answer came."""
    value: Any = None
    reason: str = ""
    node: str = ""


@dataclass(frozen=True)
class Trial:
    """One run of one node in a world. `pace` is "lockstep" or "real time"; `ended` is "" for a complete script."""

    name: str
    node: str
    world: str
    seed: int
    ready: bool
    pace: str
    ended: str
    script_error: str = ""
    choices: dict[str, float] = field(default_factory=dict)
    marks: dict[str, float] = field(default_factory=dict)
    commands: list[Command] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)
    scans: list[ScanSummary] = field(default_factory=list)
    touches: list[Touch] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)
    goals: list[Goal] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    published: list[Message] = field(default_factory=list)
    """What the simulated sensors said, for trials that ask what a node makes of it."""
    parameters: list[ParameterAnswer] = field(default_factory=list)
    scene: dict[str, Any] = field(default_factory=dict)
    """The world with everything that was put into it, in the schema of the world files."""
    graph: Graph | None = None
    other_graph: Graph | None = None
    """What the graph shows of a second node that the script looked at."""
    launch: str = ""
    """The launch file that was run, "" if the node was started by itself."""
    process: ProcessEnd | None = None
    wall_seconds: float = 0.0
    others: dict[str, ProcessEnd] = field(default_factory=dict)
    """Other processes of the submission that ran beside the node, by name."""
    foreign: list[str] = field(default_factory=list)
    """Publishers of what the simulator alone publishes, such as /clock: "topic by node"."""
    dropped: int = 0
    """How many messages came beyond those that were kept."""
    stopped: str = ""
    """The limit of the whole wall that the node met: "memory", "processes" or ""."""


@dataclass(frozen=True)
class FunctionAnswer:
    """What one of the package's functions returned: one number, or the four of a quaternion; empty with a problem."""

    function: str
    arguments: list[Any]
    answer: list[float] = field(default_factory=list)
    problem: str = ""


@dataclass(frozen=True)
class Evidence:
    """Everything that one grading saw."""

    intake: Intake
    build: Build
    tests: OwnTests | None = None
    trials: dict[str, Trial] = field(default_factory=dict)
    flags: list[Flag] = field(default_factory=list)
    conversions: list[FunctionAnswer] = field(default_factory=list)
    quality: Quality | None = None
    mutation: Mutation | None = None
    origin: dict[str, str] = field(default_factory=dict)
    """What made it, by name: seed, versions, hashes of the kit and of the submission."""


def _float_to_json(value: float) -> float | str:
    return value if math.isfinite(value) else str(value)


# In untyped dictionaries a string "nan" may be a student's word, so a float that is none of JSON's says what it is.
_FLOAT = "$float"


def _plain(value: Any) -> Any:
    """Replace the non-finite floats that sit in untyped dictionaries."""
    if isinstance(value, float):
        return value if math.isfinite(value) else {_FLOAT: str(value)}
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _unplain(value: Any) -> Any:
    """Return what `_plain` was given."""
    if isinstance(value, dict):
        return float(value[_FLOAT]) if set(value) == {_FLOAT} else {key: _unplain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_unplain(item) for item in value]
    return value


def _is_untyped(kind: Any) -> bool:
    return bool(kind == dict[str, Any])


def _converter() -> cattrs.Converter:
    converter = cattrs.Converter(forbid_extra_keys=True)
    # JSON knows neither inf nor nan; float() reads back the words that str() writes.
    converter.register_unstructure_hook(float, _float_to_json)
    converter.register_unstructure_hook_func(_is_untyped, _plain)
    converter.register_structure_hook_func(_is_untyped, lambda value, _: _unplain(dict(value)))
    return converter


_CONVERTER = _converter()


def to_json(fact: Any) -> str:
    """Return `fact` (a dataclass of this module, or a list of them) as strict JSON."""
    return json.dumps(_CONVERTER.unstructure(fact), indent=1, allow_nan=False, sort_keys=True)


def from_json(text: str, kind: type[T]) -> T:
    """Return the fact that `to_json` wrote.

    Raises:
        ValueError: the text is no JSON, or does not describe a `kind`.
    """
    try:
        return _CONVERTER.structure(json.loads(text), kind)
    except (cattrs.BaseValidationError, AttributeError, TypeError, KeyError) as error:
        raise ValueError(f"not a {getattr(kind, '__name__', kind)}: {error!r}") from error


def save(evidence: Evidence, folder: Path) -> None:
    """Write `evidence` below `folder`, one file a fact."""
    (folder / "trials").mkdir(parents=True, exist_ok=True)
    (folder / "submission.json").write_text(to_json(evidence.intake))
    (folder / "build.json").write_text(to_json(evidence.build))
    (folder / "flags.json").write_text(to_json(evidence.flags))
    (folder / "conversions.json").write_text(to_json(evidence.conversions))
    (folder / "origin.json").write_text(to_json(evidence.origin))
    if evidence.tests is not None:
        (folder / "tests.json").write_text(to_json(evidence.tests))
    if evidence.mutation is not None:
        (folder / "mutation.json").write_text(to_json(evidence.mutation))
    if evidence.quality is not None:
        (folder / "quality.json").write_text(to_json(evidence.quality))
    for trial in evidence.trials.values():
        (folder / "trials" / f"{trial.name}.json").write_text(to_json(trial))


def load(folder: Path) -> Evidence:
    """Read what `save` wrote.

    Raises:
        ValueError: a file is damaged; the message names it.
        OSError: a file cannot be read.
    """
    tests = folder / "tests.json"
    mutation = folder / "mutation.json"
    quality = folder / "quality.json"
    origin = folder / "origin.json"
    trials = [_read(path, Trial) for path in sorted((folder / "trials").glob("*.json"))]
    return Evidence(
        intake=_read(folder / "submission.json", Intake),
        build=_read(folder / "build.json", Build),
        tests=_read(tests, OwnTests) if tests.exists() else None,
        mutation=_read(mutation, Mutation) if mutation.exists() else None,
        quality=_read(quality, Quality) if quality.exists() else None,
        trials={trial.name: trial for trial in trials},
        flags=_read(folder / "flags.json", list[Flag]),
        conversions=_read(folder / "conversions.json", list[FunctionAnswer]),
        origin=_read(origin, dict[str, str]) if origin.exists() else {},
    )


def _read(path: Path, kind: type[T]) -> T:
    try:
        return from_json(path.read_text(), kind)
    except ValueError as error:
        raise ValueError(f"{path.name} is damaged: {error}") from error
