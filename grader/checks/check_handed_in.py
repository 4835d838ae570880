"""Q6: what is handed in besides the nodes: the demonstration, and the test results."""

import signal

from grader import tracebacks
from grader.checks.judge import Failed, Judge, NotReached
from grader.checks.package_text import weigh
from grader.evidence import ProcessEnd, Trial
from grader.words import say, some

NEEDS = ("quality", "linters")

# Behind an action's name. On the topic anybody can say something; the service is the observer's, who asks the node.
_STATUS_TOPIC, _SEND_GOAL = "/_action/status", "/_action/send_goal"
_ENDED = {4, 5, 6}  # action_msgs/GoalStatus: succeeded, canceled, aborted
_DROPPED = "Ignoring unexpected goal response"  # what rclpy logs if the answer comes before it has noted the request
_CRASHES = (-signal.SIGSEGV, -signal.SIGBUS, -signal.SIGABRT)
# What Python prints of an exception, and C++ of a daemon thread that still spins when Python ends.
_OWN_FAULTS = (tracebacks.BEGIN, "terminate called without an active exception")


def test_demonstration_runs(judge: Judge) -> None:
    """The demonstration script runs against the running nodes, uses a service and the action, and exits 0."""
    script = judge.course.demonstration
    if script not in judge.quality().paths:
        raise Failed(say("there is no {script}", script=script), say("write the demonstration there"))
    trial = judge.trial("demo", complete=False)
    end = trial.others.get(script.rpartition("/")[2])
    if end is None or (end.by == "us" and trial.ended):
        raise NotReached(trial.ended or say("the demonstration was not started"))
    words, share = [], 1.0
    answered = {call.service for call in trial.calls if call.response is not None}
    called = {service for service in answered if not service.endswith(_SEND_GOAL)}
    sent = _goals(trial)
    if called and sent and (excuse := _excuse(trial, end)):
        judge.remark(say("it did all it should; then {excuse}", excuse=excuse))
    elif end.by == "us":
        words.append(say("it had not ended after {end.wall_seconds:.0f} s", end=end))
        share -= 0.5
    elif end.exit_code != 0:
        words.append(say("it ended with exit status {end.exit_code}", end=end))
        share -= 0.5
    services = {name: type_ for node in judge.course.nodes.values() for name, type_ in node.services.items()}
    actions = {name: type_ for node in judge.course.nodes.values() for name, type_ in node.actions.items()}
    unseen, build = {**({} if called else services), **({} if sent else actions)}, judge.evidence.build
    changed = [name for name in unseen.values() if build.type_hashes.get(name) != build.contract_hashes.get(name)]
    if changed:
        said = say("{changed} differs from the contract, so its calls cannot be observed", changed=", ".join(changed))
        raise NotReached(said, *judge.judged_by("check_interfaces"))
    if not called:
        words.append(say("it called none of {services}", services=", ".join(services)))
        share -= 0.25
    if not sent:
        words.append(say("it sent no goal to {keys}", keys=" or ".join(actions)))
        share -= 0.25
    if words:
        last = [line for line in end.output_tail.splitlines() if line.strip()][-3:]
        words += [say("its last output: {lines}", lines=" / ".join(line.strip()[:200] for line in last))] * bool(last)
        # A script that does nothing but end well has shown nothing.
        share = share if called or sent else 0.0
        try_ = say("start the nodes in a simulator, run the script by hand, then `echo $?`")
        judge.share(share, "\n".join(words), try_)


def test_test_results_match_the_tests(judge: Judge) -> None:
    """`test_results.xml` is a junit report of the package's own tests."""
    weigh(judge)
    quality = judge.quality()
    report = quality.report
    try_ = say("python -m pytest test --junitxml=test_results.xml, in the package's folder, after the last change")
    if report is None:
        raise Failed(say("there is no test_results.xml"), try_)
    judge.expect(not report.problem, say("test_results.xml {report.problem}", report=report), try_)
    judge.expect(bool(quality.tests), say("the package has no tests to report on"), say("write tests first"))
    reported = {_matched(case, quality.tests) for case in report.cases}
    foreign = sorted({case for case in report.cases if not _matched(case, quality.tests)})
    absent = [test for test in quality.tests if test not in reported]
    if foreign or absent:
        words = [say("not in the report: {absent}", absent=some(absent))] if absent else []
        words += [say("in the report, but not in the package: {foreign}", foreign=some(foreign))] if foreign else []
        together = len(quality.tests) + len({case.rpartition("::")[2] for case in foreign})
        judge.share((len(quality.tests) - len(absent)) / together, "\n".join(words), try_)


def _excuse(trial: Trial, end: ProcessEnd) -> str:
    """Return which fault of the ROS libraries kept a demonstration from ending well, "" if it was its own.

    A crash in rclpy shows in faulthandler's dump; one as the process exits leaves none. It is a wrong use if another
    thread still spins. A script that fakes all of this gets what it has earned before.
    """
    if end.by == "us":
        dropped = _DROPPED in end.output_tail
        return say("rclpy dropped the answer to its goal, for which it waited (ros2/rclpy#1123)") if dropped else ""
    output = tracebacks.without_ignored(end.output_tail)
    inside = tracebacks.dumped_files(output)
    elsewhere = len(inside) > 1 or any("/rclpy/" not in name for name in inside)
    own = elsewhere or any(words in output for words in _OWN_FAULTS)
    if own or end.exit_code not in _CRASHES or not set(_goals(trial).values()) <= _ENDED:
        return ""
    return say("the ROS libraries crashed as it ended (exit status {end.exit_code})", end=end)


def _goals(trial: Trial) -> dict[str, int]:
    """Return the goals that the node accepted, each with the last status that the action's topic reported."""
    told = {str(m.data.get("goal")): m.data.get("status", 0) for m in trial.messages if m.topic.endswith(_STATUS_TOPIC)}
    sent = [call for call in trial.calls if call.service.endswith(_SEND_GOAL) and (call.response or {}).get("accepted")]
    return {goal: told.get(goal, 0) for goal in (str(call.request.get("goal")) for call in sent)}


def _matched(case: str, tests: list[str]) -> str:
    """Return the test of the package that a case of the report belongs to, "" if there is none.

    How much of the path is in the name depends on where pytest was started; the module's name always is.
    """
    where, _, name = case.rpartition("::")
    parts = where.replace("/", ".").removesuffix(".py").split(".")
    same = [test for test in tests if test.rpartition("::")[2] == name]
    return next((test for test in same if not where or test.rpartition("::")[0] in parts), "")
