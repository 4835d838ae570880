"""T1 and T2: the package's own tests, and what they reach."""

from grader.checks.judge import Judge, NotReached
from grader.evidence import OwnTests, TestModule

_NODES = ("robot_controller", "sensor_processor")


def test_both_nodes_have_tests(judge: Judge) -> None:
    """Tests exist for both nodes."""
    modules = _own(judge)
    missing = [node for node in _NODES if not any(node in module.subjects and module.tests for module in modules)]
    if missing:
        looked = ", ".join(module.path for module in modules) or "no test module of your own"
        share = 1 - len(missing) / len(_NODES)
        judge.share(share, f"no test uses {', '.join(missing)}; found {looked}", "write test/test_<node>.py for each")


def test_every_test_asserts_something(judge: Judge) -> None:
    """The tests assert something."""
    modules = _own(judge)
    tests, asserting = sum(m.tests for m in modules), sum(m.asserting for m in modules)
    judge.expect(tests > 0, _nothing(judge), "write a test that would fail if the node were wrong")
    if asserting < tests:
        seen = f"{tests - asserting} of {tests} tests hold no assertion"
        judge.share(asserting / tests, seen, "a test without an assert passes whatever the code does")


def test_own_tests_pass(judge: Judge) -> None:
    """The tests pass under pytest in a fresh environment."""
    modules = _own(judge)
    ran = sum(m.passed + m.failed + m.errors for m in modules)
    passed = sum(m.passed for m in modules)
    if not ran:
        seen = "no test ran to its end" if modules else _nothing(judge)
        judge.expect(False, seen, "run pytest in a clean folder")
    late = [m.path for m in modules if m.timed_out]
    problems = [failure for m in modules for failure in m.failures][:3] + [f"{path} ran out of time" for path in late]
    if passed < ran or late:
        share = passed / (ran + len(late))
        judge.share(share, f"{passed} of {ran} tests passed; {'; '.join(problems)}", "run pytest in a clean folder")


def test_coverage_of_lines_and_branches(judge: Judge) -> None:
    """Line and branch coverage of the package by its own tests: none at 40 %, full at 90 %, linear between."""
    tests = _tests(judge)
    if not tests.coverage:
        raise NotReached("no test ran, so nothing was covered (T1)")
    total = sum(f.lines + f.branches for f in tests.coverage)
    hit = sum(f.lines_hit + f.branches_hit for f in tests.coverage)
    percent = 100 * hit / total if total else 0.0
    worst = sorted(tests.coverage, key=lambda f: f.lines_hit + f.branches_hit - f.lines - f.branches)[:3]
    words = ", ".join(f"{f.path} lines {_ranges(f.missing)}" for f in worst if f.missing)
    # Whole tenths of a percent, so that the last digit of a float never decides a point.
    share = (round(percent, 1) - 40) / 50
    if share < 1:
        judge.share(share, f"{percent:.1f} % covered; not reached: {words or 'some branches'}", "test what is listed")


def _tests(judge: Judge) -> OwnTests:
    judge.built()
    if judge.evidence.tests is None:
        raise RuntimeError("the package's own tests were not run")
    return judge.evidence.tests


def _own(judge: Judge) -> list[TestModule]:
    """Return the modules that say something about the package: not the generated linter stubs."""
    return [module for module in _tests(judge).modules if not module.stub]


def _nothing(judge: Judge) -> str:
    stubs = [m.path for m in _tests(judge).modules if m.stub]
    return f"only generated linter tests: {', '.join(stubs)}" if stubs else "no tests in test/ or tests/"


def _ranges(lines: list[int]) -> str:
    """Return "3-5, 9" for [3, 4, 5, 9], at most five pieces."""
    pieces: list[list[int]] = []
    for line in sorted(lines):
        if pieces and line == pieces[-1][1] + 1:
            pieces[-1][1] = line
        else:
            pieces.append([line, line])
    words = [f"{a}" if a == b else f"{a}-{b}" for a, b in pieces[:5]]
    return ", ".join(words) + (", ..." if len(pieces) > 5 else "")
