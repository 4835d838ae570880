"""T1 and T2: the package's own tests, and their coverage."""

from grader.checks.judge import Judge, NotReached
from grader.checks.wording import place
from grader.evidence import TestModule
from grader.words import mark, say, some

NEEDS = ("student tests", "what ran")
_TRY_TESTS = mark(
    "{files} must run the node's own code, which neither an import of it does nor a mock in its place: make the node "
    "(after rclpy.init()) or call its functions"
)
_STEADY = mark(
    "a test must not depend on chance or on the machine's speed: wait for what it is about, and fix what is random"
)


def test_both_nodes_have_tests(judge: Judge) -> None:
    """Tests exist for both nodes."""
    modules, own = _own(judge), judge.measured().of_node
    nodes = judge.course.nodes
    tested = {path for module in modules for path in module.tested} | {name for m in modules for name in m.starts}
    missing = [node for node in nodes if tested.isdisjoint({node, *own.get(node, ())})]
    if missing:
        looked = ", ".join(_describe(judge, module) for module in modules) or _nothing(judge)
        words = mark("no test that asserts something runs code of {missing}; found {looked}")
        files = say(" and ").join(f"test/test_{node}.py" for node in missing)
        seen = say(words, missing=" or ".join(missing), looked=looked)
        judge.share(1 - len(missing) / len(nodes), seen, say(_TRY_TESTS, files=files))
    elif idle := [f"{module.path} {name}" for module in modules for name in module.idle]:
        judge.remark(
            say("these tests pass although every function that they call raises: {idle}", idle=some(idle, 3)),
            say("a test of what goes wrong expects the one error that it is about"),
        )


def test_every_test_asserts_something(judge: Judge) -> None:
    """The tests assert something."""
    modules = _reaching(judge)
    tests = sum(m.tests for m in modules)
    silent = [f"{m.path} {name}" for m in modules for name in dict.fromkeys([*m.silent, *m.idle])]
    asserting = sum(m.asserting - len({*m.idle} - {*m.silent}) for m in modules)
    judge.expect(tests > 0, _nothing(judge), say("write a test that fails when the node is wrong"))
    if asserting < tests:
        words = mark("{n} of {tests} tests assert nothing: {silent}")
        try_ = say(
            "a test passes whatever the code does without an assert, with one that always holds (`or True`), or where "
            "`except` takes up every failure"
        )
        judge.share(asserting / tests, say(words, n=tests - asserting, tests=tests, silent=some(silent, 3)), try_)


def test_own_tests_pass(judge: Judge) -> None:
    """The tests pass under pytest in a fresh environment."""
    modules = _own(judge)
    if not sum(m.tests for m in modules):
        raise NotReached(_nothing(judge))
    if not sum(m.asserting for m in modules):
        raise NotReached(say("no test asserts anything, so that they pass shows nothing"))
    # A module of which no test can fail shows nothing by passing; but one that cannot be imported fails.
    measured = judge.measured().whole
    passed = sum(m.passed for m in modules if measured.intersection(m.tested) or m.starts)
    ran = passed + sum(m.failed + m.errors for m in modules)
    unsteady = some([f"{m.path} {name}" for m in modules for name in m.unsteady], 3)
    words = mark("these tests passed in one of two runs and failed in the other, so they do not count: {unsteady}")
    changing = say(words, unsteady=unsteady)
    judge.expect(bool(ran or not unsteady), changing, _STEADY)
    if not ran and any(m.passed for m in modules):
        names = some([module.path for module in modules], 3)
        raise NotReached(say("no test that passed tests code of the package: {names}", names=names))
    judge.expect(ran > 0, say("no test ran: all were skipped"), say("run pytest in a clean folder"))
    problems = [failure for m in modules for failure in m.failures]
    if passed < ran:
        more = ran - passed - len(problems[:3])
        said = [say("{passed} of {ran} tests passed", passed=passed, ran=ran), *problems[:3]]
        seen = "; ".join([*said, *([say("and {more} more", more=more)] if more else [])])
        try_ = say(
            "run pytest in a clean folder: what fails each time expects something else than the code does; what fails "
            "only sometimes depends on the speed of the machine"
        )
        judge.share(passed / ran, seen, try_)
    if unsteady:
        judge.remark(changing, _STEADY)
    if sleeps := [habit for habit in judge.habits if habit.rule == "sleep-in-test"]:
        places = some([f"{place(habit)} {habit.text}" for habit in sleeps], 3)
        seen = say("these tests sleep, which costs no points, and time in every run: {places}", places=places)
        judge.remark(seen, say("wait for what the test is about, with a deadline: spin until the message is there"))


def test_coverage_of_lines_and_branches(judge: Judge) -> None:
    """Line and branch coverage of the package by its own tests: none at 40 %, full at 90 %, linear between."""
    tests = judge.student_tests()
    if not any(m.passed + m.failed for m in _own(judge)):
        raise NotReached(say("no test ran, so nothing was covered"), *judge.judged_by("check_student_tests"))
    measured = judge.measured().whole
    coverage = [file for file in tests.coverage if file.path in measured]
    judge.expect(bool(coverage), say("the tests ran no line of the package"), say("import the package in the tests"))
    hit = sum(f.lines_hit + f.branches_hit for f in coverage)
    percent = 100 * hit / max(1, sum(f.lines + f.branches for f in coverage))
    worst = sorted(coverage, key=lambda f: f.lines_hit + f.branches_hit - f.lines - f.branches)[:3]
    words = ", ".join(say("{f.path} lines {ranges}", f=f, ranges=_ranges(f.missing)) for f in worst if f.missing)
    words = words or say("some branches")
    # Whole tenths of a percent, so that the last digit of a float never decides a point.
    share = (round(percent, 1) - 40) / 50
    if share < 1:
        seen = say("{percent:.1f} % covered; not reached: {words}", percent=percent, words=words)
        judge.share(share, seen, say("write tests for the lines listed"))


def _own(judge: Judge) -> list[TestModule]:
    """Return the modules that test the package, without the generated linter stubs."""
    return [module for module in judge.student_tests().modules if not module.stub]


def _reaching(judge: Judge) -> list[TestModule]:
    """Return the modules whose tests run code of the package: only those can show anything about it."""
    names = some([module.path for module in _own(judge)], 3)
    seen = say("no test runs code of the package: {names}", names=names) if names else _nothing(judge)
    found = [module for module in _own(judge) if _reaches(judge, module)]
    try_ = say("call the package's functions in the tests, and assert what they return or publish")
    judge.expect(bool(found), seen, try_)
    return found


def _reaches(judge: Judge, module: TestModule) -> bool:
    """Return whether tests run code of the package that a node runs, too."""
    return bool(judge.measured().whole.intersection(module.reached) or module.starts)


def _describe(judge: Judge, module: TestModule) -> str:
    lacks = (
        (not module.asserting, mark("no test that asserts anything")),
        (not _reaches(judge, module), mark("runs no code of the package")),
        (module.idle and not module.tested, mark("passes whatever the code does")),
    )
    what = next((say(words) for holds, words in lacks if holds), "")
    return f"{module.path} ({what})" if what else module.path


def _nothing(judge: Judge) -> str:
    stubs = [m.path for m in judge.student_tests().modules if m.stub]
    if not stubs:
        return say("no tests in test/ or tests/")
    return say("only generated tests that call a linter and do not test the code: {stubs}", stubs=", ".join(stubs))


def _ranges(lines: list[int]) -> str:
    """Return "3-5, 9" for [3, 4, 5, 9], with at most five ranges."""
    pieces: list[list[int]] = []
    for line in sorted(lines):
        if pieces and line == pieces[-1][1] + 1:
            pieces[-1][1] = line
        else:
            pieces.append([line, line])
    words = [f"{a}" if a == b else f"{a}-{b}" for a, b in pieces[:5]]
    return ", ".join(words) + (", ..." if len(pieces) > 5 else "")
