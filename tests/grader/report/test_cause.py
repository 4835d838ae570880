"""The first cause: what most of the lost points follow from, in one sentence."""

from __future__ import annotations

from dataclasses import replace

from helpers import judging, recordings
from helpers.report_examples import BUILD, INTAKE, RUBRIC, drive_at_a_wall, good, grading, results

from grader.evidence import Evidence, Fault, Graph, Kind, ProcessEnd, Reason
from grader.report import cause, html
from grader.scoring.rubric import load
from grader.scoring.scorecard import CheckResult, Outcome

DIED = Reason(Kind.DIED_EARLY, exit_code=1)
TRACEBACK = """\
Traceback (most recent call last):
  File "/ws/install/ros2_robot_controller/lib/ros2_robot_controller/robot_controller", line 4, in <module>
    from ros2_robot_controller.robot_controller import main
  File "/ws/install/ros2_robot_controller/lib/python3.12/site-packages/ros2_robot_controller/driver.py", line 7
    import tf_transformations
  File "/usr/lib/python3.12/importlib/__init__.py", line 90, in import_module
ModuleNotFoundError: No module named 'tf_transformations'
"""


def not_up(output=TRACEBACK, **changes):
    end = ProcessEnd("itself", 1, 0.4, output)
    return replace(drive_at_a_wall(), ready=False, ended=DIED, samples=[], process=end, **changes)


def not_reached(check, reason, trial=""):
    return CheckResult(check, Outcome.NOT_REACHED, 0, because=f"{reason}; and more", trial=trial, reason=reason)


def waiting(rubric, reason, trial=""):
    return [not_reached(check.id, reason, trial) for check in rubric.checks]


def test_nodes_that_do_not_start_are_named_with_the_exception_and_its_place(rubric):
    evidence = Evidence(INTAKE, BUILD, trials={"drive_at_a_wall": not_up()})
    found = cause.find(grading(rubric, waiting(rubric, DIED, "drive_at_a_wall"), evidence))
    assert str(found) == (
        "No node started: ModuleNotFoundError: No module named 'tf_transformations' at "
        "ros2_robot_controller/driver.py:7; 8 points follow from it"
    )


def test_only_the_node_that_did_not_start_is_named(rubric):
    """A launch file of both nodes does not start either, and is a trial of the controller."""
    fuses = not_up(node="sensor_processor")
    trials = {"drive_at_a_wall": fuses, "launch_robot_controller": not_up(), "other": drive_at_a_wall()}
    first, *others = waiting(rubric, DIED, "drive_at_a_wall")
    made = grading(
        rubric, [replace(first, trial="launch_robot_controller"), *others], Evidence(INTAKE, BUILD, trials=trials)
    )
    assert str(cause.find(made)).startswith("sensor_processor did not start: ModuleNotFoundError")


def test_a_node_that_came_up_under_another_name_has_started(rubric):
    """It was once said that no node had started."""
    ended = Reason(Kind.NOT_UP, "robot_controller", seconds=30.0, nodes=("driver",))
    trial = replace(not_up(""), ended=ended, process=None, graph=Graph(nodes=["driver"]))
    evidence = Evidence(INTAKE, BUILD, trials={"drive_at_a_wall": trial})
    found = cause.find(grading(rubric, waiting(rubric, ended, "drive_at_a_wall"), evidence))
    expected = "robot_controller did not start: no node robot_controller came up; the graph shows driver"
    assert found.sentence == expected


def test_what_the_packages_text_shows_comes_before_what_the_node_printed(rubric):
    because = replace(DIED, fault=Fault("driver.py", 7, "start", "it imports `tf`, which is not there", "add it"))
    evidence = Evidence(INTAKE, BUILD, trials={"drive_at_a_wall": not_up()})
    found = cause.find(grading(rubric, waiting(rubric, because, "drive_at_a_wall"), evidence))
    assert found.sentence == "No node started: driver.py:7: it imports `tf`, which is not there (add it)"


def test_a_requirement_that_others_wait_for_is_the_cause_and_counts(rubric):
    late = CheckResult("check_obstacle::test_stops_in_time", Outcome.FAILED, 0, seen="it never drove")
    waits = not_reached("check_navigation::test_reaches_a_target", Reason(Kind.DEPENDS, requirements=("F4",)))
    found = cause.find(grading(rubric, results(rubric, late, waits)))
    assert str(found) == "F4 Stops before an obstacle: it never drove; 5 points follow from it"


def test_single_losses_have_no_common_cause(rubric):
    late = CheckResult("check_obstacle::test_stops_in_time", Outcome.FAILED, 0, seen="0.9 s late")
    far = CheckResult("check_navigation::test_reaches_a_target", Outcome.FAILED, 0, seen="1 m off")
    made = grading(rubric, results(rubric, late, far))
    assert cause.find(made) is None
    page = html.render(made)
    assert "First cause" not in page
    top = page[page.index("What cost most") : page.index("</section>")]
    assert top.index("F8") < top.index("F4"), "3 points come before 2"


def test_a_cause_that_costs_less_than_something_else_is_not_the_first(rubric):
    one = CheckResult("check_obstacle::test_stops_in_time", Outcome.NOT_REACHED, 0, because="nothing came")
    dear = CheckResult("check_navigation::test_reaches_a_target", Outcome.FAILED, 0, seen="1 m off")
    assert cause.find(grading(rubric, results(rubric, one, dear))) is None


def test_full_marks_have_no_cause():
    assert cause.find(good(load(RUBRIC))) is None


def test_a_hostile_traceback_is_made_safe_to_show(rubric):
    output = TRACEBACK.splitlines()[0] + "\nValueError: \x1b[2J\u202e" + "x" * 10_000
    evidence = Evidence(INTAKE, BUILD, trials={"drive_at_a_wall": not_up(output)})
    sentence = cause.find(grading(rubric, waiting(rubric, DIED, "drive_at_a_wall"), evidence)).sentence
    assert sentence.isprintable()
    assert r"\x1b[2J\u202e" in sentence
    assert len(sentence) < 500


def test_a_build_that_fails_is_said_once_and_what_follows_is_folded():
    rubric, evidence = load(RUBRIC), recordings.load("does_not_compile")
    made = grading(rubric, judging.judged(evidence), evidence)
    sentence = str(cause.find(made))
    assert sentence.startswith("The package does not build: ")
    assert "FusedData.msg" in sentence
    lost = made.scorecard.max - made.scorecard.points
    assert sentence.endswith(f"; {lost:g} points follow from it")
    page = html.render(made)
    assert page.count("ended with exit status 1 (I1)") == 0, "those that follow refer to the first cause"
    assert "<details>\n<summary>What follows from it" in page
