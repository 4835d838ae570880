"""Q1 to Q6: what the package's text shows, its README against the graph, the demonstration."""

import math

from grader.checks.findings import MOST_SHOWN, listing, place, some
from grader.checks.interface_table import agreement
from grader.checks.judge import Judge, NotReached
from grader.contract.layout import JUDGED, role
from grader.contract.spec import PACKAGE
from grader.evidence import Build, Definition, Finding, Quality, SourceFile, Trial, reading_limits

_LAYOUT = (
    "CMakeLists.txt",
    "package.xml",
    "setup.py",
    "setup.cfg",
    f"{PACKAGE}/__init__.py",
    f"{PACKAGE}/robot_controller.py",
    f"{PACKAGE}/sensor_processor.py",
    f"{PACKAGE}/utils/__init__.py",
    f"{PACKAGE}/utils/conversions.py",
    "msg/SensorFusionData.msg",
    "srv/SetSpeed.srv",
    "srv/GetRobotStatus.srv",
    "action/NavigateToPosition.action",
    "launch/robot_controller_launch.py",
    "launch/sensor_processor_launch.py",
    "config/robot_params.yaml",
    "config/sensor_params.yaml",
    "scripts/demo.py",
    "test/test_robot_controller.py",
    "test/test_sensor_processor.py",
    "test_results.xml",
    "README.md",
)
_CONVERSIONS = ("yaw_from_quaternion", "quaternion_from_yaw", "normalize_angle", "clamp")
_SERVICES = ("set_speed", "get_status")
_STATUS_TOPIC = "navigate_to_position/_action/status"


def test_ament_flake8_finds_nothing(judge: Judge) -> None:
    """ament_flake8's rules hold: full marks at no finding, none at 1 per 10 lines of code."""
    quality = _read(judge)
    broken = [file for file in quality.files if file.problem]
    # What a linter cannot read is no better than code with a finding on every tenth line.
    count = quality.style_count + sum(max(1.0, file.lines / 10) for file in broken)
    lines = reading_limits.counted_lines(quality.files)
    suppressed = _suppressed(quality)
    if not count:
        judge.share(1.0, suppressed, "")
        return
    said = (
        f"{quality.style_count} finding{'s'[: quality.style_count - 1]} in {lines} lines of code"
        if quality.style_count
        else ""
    )
    unread = [f"{file.path} {file.problem}" for file in broken[:MOST_SHOWN]]
    parts = [said, listing(quality.style), *unread, suppressed]
    seen = "\n".join(part for part in parts if part)
    judge.share(1 - 10 * count / max(1, lines), seen, "run `ament_flake8` in the package's folder; it says the same")


def test_public_things_have_docstrings(judge: Judge) -> None:
    """Public modules, classes and functions have docstrings: full marks at 90 %, none at 0 %, linear between."""
    things = _public(judge)
    unread = _unread(judge)
    bare = [thing for thing in things if not thing.documented]
    share = 1 - len(bare) / len(things)
    if share < 0.9 or unread:
        names = [_name(thing) for thing in bare[:MOST_SHOWN]]
        said = [f"{len(things) - len(bare)} of {len(things)} have a docstring; none at", *names] if bare else []
        seen = "\n".join([*said, *_said(unread)])
        share = min(share / 0.9, 1 - _part(judge, unread))
        judge.share(share, seen, "say in one sentence what a caller gets, with units and frames")


def test_docstrings_keep_ament_pep257(judge: Judge) -> None:
    """ament_pep257's rules hold for the docstrings of public modules, classes and functions."""
    things = _public(judge)
    documented = [thing for thing in things if thing.documented]
    clean = [thing for thing in documented if not thing.violations]
    # A single docstring without a fault is not worth the marks of a package full of them.
    wanted = max(len(documented), 0.9 * len(things))
    unread = _unread(judge)
    if len(clean) < wanted or unread:
        faults = [fault for thing in documented for fault in thing.violations]
        seen = f"{len(clean)} of {len(things)} have a docstring that keeps every rule"
        seen = "\n".join([seen, *([listing(faults)] if faults else []), *_said(unread)])
        share = min(len(clean) / wanted, 1 - _part(judge, unread))
        judge.share(share, seen, "run `ament_pep257` in the package's folder; it says the same")


def test_layout_is_the_contracts(judge: Judge) -> None:
    """The package has the contract's layout; each missing path loses a share."""
    paths = set(_within_bounds(judge).paths)
    missing = [path for path in _LAYOUT if path not in paths]
    if missing:
        seen = f"missing: {some(missing, len(_LAYOUT))}"
        meant = [_like(path, paths) for path in missing]
        near = [path for path in dict.fromkeys(meant) if path]
        seen += f"; perhaps meant: {some(near)}" if near else ""
        judge.share(1 - len(missing) / len(_LAYOUT), seen, "compare names and folders with the contract's tree")


def test_no_function_is_too_complex(judge: Judge) -> None:
    """No function is above cyclomatic complexity 10; each that is loses a quarter."""
    found = _read(judge).complex
    words = [f"{len(found)} above 10", listing(found)]
    _charge(judge, len(found), 4, words, "give a part that decides one thing a function of its own")


def test_conversions_are_in_utils_and_used(judge: Judge) -> None:
    """The conversions are in `utils/`, and the nodes use them instead of making their own."""
    quality = _read(judge)
    found = quality.conversions
    missing = [name for name in _CONVERSIONS if name not in found.defined]
    words = []
    share = 1.0
    if missing:
        words.append(f"utils/conversions.py does not define {', '.join(missing)}")
        share -= 0.5 * len(missing) / len(_CONVERSIONS)
    if not found.calls:
        words.append("no node calls a function of utils/conversions.py, directly or through another module")
        share -= 0.5
    if found.elsewhere:
        words += [f"{place(finding)} {finding.text}" for finding in found.elsewhere[:MOST_SHOWN]]
        share -= 0.25 * len(found.elsewhere)
    unread = _unread(judge)
    if unread:
        words += _said(unread)
        share -= _part(judge, unread)
    if words:
        judge.share(share, "\n".join(words), f"import them: from {PACKAGE}.utils.conversions import normalize_angle")


def test_no_block_stands_twice(judge: Judge) -> None:
    """No block of six or more lines stands twice in the package; each that does loses a quarter."""
    copies = _read(judge).copies
    shown = [f"{copy.lines} lines: {' = '.join(copy.places)}" for copy in copies[:MOST_SHOWN]]
    words = [f"{len(copies)} {'block stands' if len(copies) == 1 else 'blocks stand'} more than once", *shown]
    _charge(judge, len(copies), 4, words, "make the block a function in utils/: a fault is then mended once")


def test_no_bare_except_print_or_mutable_default(judge: Judge) -> None:
    """No bare `except`, no `print` in the package's modules, no mutable default; each loses a quarter."""
    bad = _habits(judge, "bare-except", "print", "mutable-default")
    _charge(judge, len(bad), 4, [listing(bad)], "name the exception; use self.get_logger(); use None as default")


def test_callbacks_do_not_sleep(judge: Judge) -> None:
    """No `time.sleep` in a callback, nor in a function of the package that a callback calls; each loses a half."""
    bad = _habits(judge, "sleep-in-callback")
    _charge(judge, len(bad), 2, [listing(bad)], "let a timer do the next step, and await a future in the action")


def test_contract_numbers_are_parameters(judge: Judge) -> None:
    """The numbers that the contract names as parameters are declared as parameters and read from them."""
    uses = _read(judge).parameters
    bad = []
    for use in uses:
        if not use.declared:
            bad.append(f"{use.node}: {use.name} is declared nowhere in the code")
        elif not use.read:
            bad.append(f"{use.node}: {use.name} is declared but never read")
        else:
            continue
        if use.literals:
            where = some([place(finding) for finding in use.literals])
            bad[-1] += f" (a {use.literals[0].text} stands in {where})"
    if bad:
        try_ = "self.declare_parameter('name', default), then self.get_parameter('name').value where it counts"
        judge.share(1 - len(bad) / len(uses), "\n".join(bad), try_)


def test_public_functions_are_annotated(judge: Judge) -> None:
    """Public functions carry type annotations, for every parameter and for what they return."""
    functions = [thing for thing in _public(judge) if thing.kind == "function"]
    judge.expect(bool(functions), "there is no public function", "give the work that callbacks do to functions")
    bare = [thing for thing in functions if thing.unannotated]
    unread = _unread(judge)
    if bare or unread:
        shown = [f"{_name(thing)}: {', '.join(thing.unannotated[:6])}" for thing in bare[:MOST_SHOWN]]
        said = [f"{len(bare)} of {len(functions)} lack annotations", *shown] if bare else []
        seen = "\n".join([*said, *_said(unread)])
        share = min(1 - len(bare) / len(functions), 1 - _part(judge, unread))
        judge.share(share, seen, "def clamp(value: float, low: float, high: float) -> float")


def test_readme_says_what_and_how(judge: Judge) -> None:
    """README.md says what the package does, and how to build, run and test it."""
    quality = judge.quality()
    readme = quality.readme
    if readme is None:
        others = [path for path in quality.paths if path.lower().startswith("readme")]
        found = f"; found {', '.join(others)}" if others else ""
        judge.expect(False, f"there is no README.md beside package.xml{found}", "write README.md in the package")
        return
    missing = []
    if readme.words < _WORDS:
        missing.append(f"what it does ({readme.words} words of prose, {_WORDS} or more say something)")
    elif readme.placeholders:
        where = ", ".join(f"line {finding.line}: {finding.text}" for finding in readme.placeholders[:3])
        missing.append(f"what it does, where a placeholder stands ({where})")
    commands = {"build": "colcon build", "run": "ros2 launch or ros2 run", "test": "pytest or colcon test"}
    missing += [f"how to {what} it ({command})" for what, command in commands.items() if what not in readme.shows]
    if missing:
        seen = "not found:\n" + "\n".join(missing)
        judge.share(1 - len(missing) / 4, seen, "write for somebody who meets the package today, with commands to copy")


def test_interface_table_agrees(judge: Judge) -> None:
    """README.md holds a table of the nodes' interfaces that agrees with the running nodes: names, types, directions."""
    readme = judge.quality().readme
    if readme is None:
        raise NotReached("there is no README.md")
    found = agreement(readme.tables, judge.evidence)
    judge.expect(found.wanted > 0, "no interface is known, neither of a running node nor of the code", "see I4")
    if found.wrong:
        source = "the running nodes" if found.from_graph else "the code"
        seen = "\n".join([f"compared with {source}:", *found.wrong[: MOST_SHOWN * 2]])
        try_ = "a row for each: | robot_controller | subscribes | scan | sensor_msgs/msg/LaserScan |"
        judge.share(1 - len(found.wrong) / found.wanted, seen, try_)


def test_demonstration_runs(judge: Judge) -> None:
    """The demonstration script runs against the running nodes, uses a service and the action, and exits 0."""
    if "scripts/demo.py" not in judge.quality().paths:
        judge.expect(False, "there is no scripts/demo.py", "write the demonstration there")
    trial = judge.trial("demo", complete=False)
    end = trial.others.get("demo.py")
    if end is None or (end.by == "us" and trial.ended):
        raise NotReached(trial.ended or "the demonstration was not started")
    words, share = [], 1.0
    if end.by == "us":
        words.append(f"it had not ended after {end.wall_seconds:.0f} s")
        share -= 0.5
    elif end.exit_code != 0:
        words.append(f"it ended with exit status {end.exit_code}")
        share -= 0.5
    called = {call.service for call in trial.calls if call.response is not None}
    if not called and _other_services(judge):
        raise NotReached(f"nobody can call {', '.join(_other_services(judge))} under the contract's type (I3)")
    if not called:
        words.append(f"it called none of {', '.join(_SERVICES)}")
        share -= 0.25
    if not _goals(trial):
        words.append("it sent no goal to navigate_to_position")
        share -= 0.25
    if words:
        last = [line for line in end.output_tail.splitlines() if line.strip()][-3:]
        words += [f"its last words: {' / '.join(line.strip()[:200] for line in last)}"] if last else []
        # A script that only ends well has shown nothing.
        share = 0.0 if not called and not _goals(trial) else share
        judge.share(share, "\n".join(words), "start both nodes in a simulator and run it by hand; then `echo $?`")


def test_test_results_are_of_own_tests(judge: Judge) -> None:
    """`test_results.xml` is a junit report of the package's own tests."""
    quality = judge.quality()
    report = quality.report
    try_ = "python -m pytest test --junitxml=test_results.xml, in the package's folder, after the last change"
    if report is None or report.problem:
        judge.expect(False, f"test_results.xml {report.problem}" if report else "there is no test_results.xml", try_)
        return
    judge.expect(bool(quality.tests), "the package has no tests that it could be a report of", "see T1")
    reported = {_matched(case, quality.tests) for case in report.cases}
    foreign = sorted({case for case in report.cases if not _matched(case, quality.tests)})
    absent = [test for test in quality.tests if test not in reported]
    if foreign or absent:
        words = [f"not in the report: {some(absent)}"] if absent else []
        words += [f"in the report, but not in the package: {some(foreign)}"] if foreign else []
        together = len(quality.tests) + len({case.rpartition("::")[2] for case in foreign})
        judge.share((len(quality.tests) - len(absent)) / together, "\n".join(words), try_)


# -- words and figures ------------------------------------------------------------------------------------------------

_WORDS = 20


# A function above complexity 10, a block that stands twice or a bad habit takes some ten lines.
_HIDES_ONE = 10


def _within_bounds(judge: Judge) -> Quality:
    """Return the facts of a package that has been looked at as a whole."""
    quality = judge.quality()
    words = reading_limits.beyond(quality.files)
    judge.expect(not words, f"{some(words)}, so nobody has looked at all of it", "leave out what the nodes do not need")
    return quality


def _unread(judge: Judge) -> list[SourceFile]:
    """Return the files that could not be read and should have been: no tests, not setup.py."""
    return [file for file in judge.quality().files if file.problem and role(file.path) in JUDGED]


def _said(unread: list[SourceFile]) -> list[str]:
    return [f"{file.path} {file.problem}; what cannot be read does not count as kept" for file in unread[:MOST_SHOWN]]


def _charge(judge: Judge, count: int, most: int, words: list[str], try_: str) -> None:
    """Take a part of `most` for each of so many findings, of which `words` tell, and for what unread files may hide."""
    unread = _unread(judge)
    if count or unread:
        seen = "\n".join([*(words if count else []), *_said(unread)])
        judge.share(1 - (count + _at_worst(unread)) / most, seen, try_)


def _part(judge: Judge, unread: list[SourceFile]) -> float:
    """Return the share of the package's lines, those of its tests left out, that stand in files not read."""
    known = [file for file in judge.quality().files if not file.problem and role(file.path) in JUDGED]
    hidden = sum(max(1, file.lines) for file in unread)
    return hidden / max(1, hidden + reading_limits.counted_lines(known))


def _at_worst(unread: list[SourceFile]) -> int:
    """Return how many findings the files that were not read may hide, where each finding has its price."""
    return sum(max(1, math.ceil(file.lines / _HIDES_ONE)) for file in unread)


def _read(judge: Judge) -> Quality:
    """Return the facts of a package with some Python in it that can be read."""
    quality = _within_bounds(judge)
    if not any(file.lines for file in quality.files if not file.problem):
        problems = [f"{file.path} {file.problem}" for file in quality.files if file.problem]
        judge.expect(False, f"no Python to read: {some(problems)}" if problems else "no Python in it", "see I1")
    return quality


def _public(judge: Judge) -> list[Definition]:
    things = _read(judge).definitions
    judge.expect(bool(things), "nothing public in the package's modules", "name things without a leading underscore")
    return things


def _name(thing: Definition) -> str:
    return f"{thing.path}:{thing.line} {thing.kind} {thing.name.rpartition('/')[2]}"


def _habits(judge: Judge, *rules: str) -> list[Finding]:
    return [finding for finding in _read(judge).habits if finding.rule in rules]


def _suppressed(quality: Quality) -> str:
    if not quality.suppressions:
        return ""
    found = quality.suppressions
    return f"comments that switch a tool off do not count here: {some([f'{place(f)} {f.text[:40]}' for f in found], 5)}"


def _like(path: str, paths: set[str]) -> str:
    """Return a path that may be meant for a missing one: the same name elsewhere, or nearly the same."""
    name = path.rpartition("/")[2].lower()
    plain = name.replace("_", "").replace(".", "").replace("-", "")
    for other in sorted(paths):
        theirs = other.rpartition("/")[2].lower()
        if name != "__init__.py" and plain == theirs.replace("_", "").replace(".", "").replace("-", ""):
            return other
    return ""


def _other_services(judge: Judge) -> list[str]:
    """Return the services whose definition is not the contract's: the observer cannot see calls of such."""
    build = judge.evidence.build
    return [f"srv/{name}" for name in ("SetSpeed", "GetRobotStatus") if _differs(build, f"srv/{name}")]


def _differs(build: Build, interface: str) -> bool:
    return build.type_hashes.get(interface) != build.contract_hashes.get(interface)


def _goals(trial: Trial) -> set[str]:
    """Return the goals that the action's status topic told of."""
    return {str(message.data.get("goal")) for message in trial.messages if message.topic == _STATUS_TOPIC}


def _matched(case: str, tests: list[str]) -> str:
    """Return the test of the package that a report's case is of, "" if there is none.

    How much of the path stands before the name depends on where pytest was started; the module's name is always in it.
    """
    where, _, name = case.rpartition("::")
    parts = where.replace("/", ".").removesuffix(".py").split(".")
    same = [test for test in tests if test.rpartition("::")[2] == name]
    return next((test for test in same if not where or test.rpartition("::")[0] in parts), "")
