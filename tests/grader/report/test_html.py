"""report.html: one file, safe to open, that a browser without a network shows whole."""

import base64
import hashlib
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from helpers.report_examples import (
    BUILD,
    CHOSEN,
    HAND_IN,
    INTAKE,
    REFUSED,
    RUBRIC,
    SMALL,
    TOUCHED,
    broken,
    drive_at_a_wall,
    good,
    grading,
    mediocre,
    results,
)

from grader.evidence import Evidence, Flag, Kind, Mutant, Mutation, Reason
from grader.report import console, data, figures, html
from grader.scoring.grading import Decision, HandIn
from grader.scoring.rubric import load
from grader.scoring.scorecard import CheckResult, Outcome

VOID = {"meta", "img", "br", "hr", "input", "link"}
# What the template itself is made of; anything else came out of somebody's text.
NAMES = """html head meta title style body header main footer section div a p span h1 h2 h3 ul ol li strong svg rect
    table thead tbody tr th td details summary code pre dl dt dd figure img figcaption script del"""
ELEMENTS = set(NAMES.split())
ATTACKS = [
    "<script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "<svg/onload=alert(1)>",
    "</pre></details><iframe src='http://x'></iframe>",
    "\"><a href='javascript:alert(1)'>click</a>",
    "</style><link rel=stylesheet href=http://x>",
    "`<b>code</b>`",
    "[x](javascript:alert(1)) **bold**",
    "{{ 7 * 7 }}{% raw %}",
    "\x1b[31m\u202egpj",
]


class Page(HTMLParser):
    """The elements of a page, and whether they are nested rightly."""

    def __init__(self, text):
        super().__init__()
        self.open, self.elements, self.attributes, self.text = [], [], [], ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.elements.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def hostile_hand_in(attack):
    decision = Decision("F8", 1.0, attack, attack)
    return HandIn((attack,), attack, attack, attack, attack, attack, (decision,), (attack,))


@pytest.mark.parametrize("make", [good, mediocre, broken])
def test_the_page_is_sound_and_needs_nothing_from_anywhere(make):
    text = html.render(make(load(RUBRIC)))
    page = Page(text)
    assert set(page.elements) <= ELEMENTS
    for tag, name, value in page.attributes:
        assert not name.startswith("on")
        assert name != "style"
        if name in ("href", "src"):
            assert value.startswith(("#", "data:image/png;base64,")), f"{tag} {name} {value[:40]}"
    assert page.elements.count("script") == 1
    targets = {value[1:] for _, name, value in page.attributes if name == "href"}
    ids = [value for _, name, value in page.attributes if name == "id"]
    assert targets <= set(ids)
    assert len(ids) == len(set(ids))


def digest(text, element):
    """Return the SHA-256 of an element's content, as a policy names it."""
    [content] = re.findall(f"<{element}>(.*?)</{element}>", text, re.S)
    return base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()


def test_the_policy_allows_nothing_but_our_style_our_script_and_our_pictures(rubric):
    text = html.render(grading(rubric, results(rubric)))
    policy = re.search(r'http-equiv="Content-Security-Policy" content="(.*?)"', text)[1]
    assert policy.split("; ") == [
        "default-src 'none'",
        "img-src data:",
        f"style-src 'sha256-{digest(text, 'style')}'",
        f"script-src 'sha256-{digest(text, 'script')}'",
        "base-uri 'none'",
        "form-action 'none'",
    ]


def test_the_packages_that_were_not_graded_and_the_reason_are_shown(rubric):
    text = " ".join(Page(html.render(grading(rubric, results(rubric), Evidence(CHOSEN, BUILD)))).text.split())
    assert "Graded: ws/src/ctl, because its folder bears its name. Not graded: old (ros2_robot_controller)." in text
    assert "Opened a.zip inside. y.rar was not opened" in text


def test_a_refusal_is_a_sound_page_that_says_why_and_what_to_do():
    text = html.render(REFUSED)
    page = Page(text)
    assert set(page.elements) <= ELEMENTS
    assert "could not be graded" in page.text
    for words in (REFUSED.because, REFUSED.try_, *REFUSED.notes):
        assert words in page.text
    assert "points were given" in page.text
    assert f"style-src 'sha256-{digest(text, 'style')}'; script-src 'sha256-{digest(text, 'script')}'" in text


@pytest.mark.parametrize("attack", ATTACKS)
def test_nothing_in_a_refusal_becomes_an_element(attack):
    refused = replace(REFUSED, submission=attack, because=attack, try_=attack, notes=[attack])
    page = Page(html.render(refused, hostile_hand_in(attack)))
    assert set(page.elements) <= ELEMENTS
    assert [page.elements.count(name) for name in ("style", "script", "title")] == [1, 1, 1]


@pytest.mark.parametrize("attack", ATTACKS)
def test_nothing_that_a_student_wrote_becomes_an_element(rubric, attack, monkeypatch):
    """In every place that a student's words can reach."""
    monkeypatch.setattr("grader.report.pictures.png", lambda _trial: b"a picture")
    result = CheckResult(
        "check_navigation::test_reaches_a_target", Outcome.FAILED, 0.0, attack, attack, attack, attack, attack
    )
    waits = CheckResult("check_obstacle::test_stops_in_time", Outcome.NOT_REACHED, 0.0, because=attack)
    trial = replace(drive_at_a_wall(), name=attack, node=attack, world=attack, ended=Reason(Kind.DEPENDS, said=attack))
    evidence = Evidence(
        replace(
            INTAKE,
            name=attack,
            package=attack,
            package_path=attack,
            notes=[attack],
            others=[attack],
            chosen_because=attack,
        ),
        replace(BUILD, ok=False, log_tail=attack),
        trials={attack: trial},
        flags=[Flag(attack, attack, attack)],
    )
    made = grading(rubric, results(rubric, result, waits), evidence, submission=attack, environment={attack: attack})
    page = Page(html.render(made, hostile_hand_in(attack)))
    assert set(page.elements) <= ELEMENTS
    assert [page.elements.count(name) for name in ("style", "script", "title")] == [1, 1, 1]
    assert all(
        value.startswith(("#", "data:image/png", "evidence/trials/"))
        for _, name, value in page.attributes
        if name in ("href", "src")
    )
    assert not any(name.startswith("on") for _, name, _ in page.attributes)
    assert not any(hidden in page.text for hidden in "\x1b\u202e")
    assert "49" not in page.text.replace(attack, "")


def test_the_worst_build_log_leaves_the_page_small(rubric):
    evidence = Evidence(INTAKE, replace(BUILD, ok=False, log_tail="<" * 10_000_000))
    assert len(html.render(grading(rubric, results(rubric), evidence))) < 100_000


def test_what_failed_is_open_and_what_passed_is_folded(rubric):
    text = html.render(grading(rubric, results(rubric, TOUCHED)))
    assert '<details class="requirement" id="F4" open>' in text
    assert '<details class="requirement" id="F8">' in text


def test_the_trial_of_the_most_expensive_loss_is_shown_once_at_the_top(rubric):
    also = CheckResult("check_obstacle::test_stops_in_time", Outcome.FAILED, 0.0, trial="drive_at_a_wall")
    evidence = Evidence(INTAKE, BUILD, trials={"drive_at_a_wall": drive_at_a_wall()})
    text = html.render(grading(rubric, results(rubric, TOUCHED, also), evidence))
    assert text.count("<img ") == 1
    assert text.index("<img ") < text.index('id="F4"')
    assert 'Replay above: <a href="#trial-0">trial drive_at_a_wall</a>.' in text
    assert 'alt="The robot went from (0.00, 0.00) to (1.83, 0.00) m' in text


def test_no_more_than_so_many_pictures_are_drawn(rubric, monkeypatch):
    monkeypatch.setattr(figures, "PICTURES", 1)
    trials = {name: replace(drive_at_a_wall(), name=name) for name in ("one", "two")}
    first = replace(TOUCHED, trial="one")
    second = CheckResult("check_navigation::test_reaches_a_target", Outcome.FAILED, 0.0, trial="two")
    text = html.render(grading(rubric, results(rubric, first, second), Evidence(INTAKE, BUILD, trials=trials)))
    assert text.count("<img ") == 1


def test_pictures_can_be_left_out(rubric):
    evidence = Evidence(INTAKE, BUILD, trials={"drive_at_a_wall": drive_at_a_wall()})
    text = html.render(grading(rubric, results(rubric, TOUCHED), evidence), pictures=False)
    assert "<img " not in text
    assert "<figure" not in text  # nor a replay


def test_a_picture_that_cannot_be_drawn_leaves_the_grade(rubric, monkeypatch):
    def broken_backend(trial):
        raise RuntimeError("no font")

    monkeypatch.setattr("grader.report.pictures.png", broken_backend)
    evidence = Evidence(INTAKE, BUILD, trials={"drive_at_a_wall": drive_at_a_wall()})
    text = html.render(grading(rubric, results(rubric, TOUCHED), evidence))
    assert "touched the wall ahead" in text
    assert "<img " not in text


def test_a_build_that_failed_shows_the_end_of_its_log_at_the_top():
    text = html.render(broken(load(RUBRIC)))
    assert text.index("The package does not build") < text.index("CMake Error at") < text.index('id="requirements"')


def test_an_incomplete_grade_says_which_requirements_a_person_must_look_at(rubric):
    text = html.render(grading(rubric, results(rubric)[1:]))
    assert "This grade is not complete" in text
    assert 'An error of the grader left <a href="#F4">F4</a> without a full verdict.' in text


def test_code_in_a_requirement_is_shown_as_code(rubric):
    assert "<code>cmd_vel</code> is zero within 0.3 s" in html.render(grading(rubric, results(rubric)))


def test_what_is_folded_is_printed():
    """By the style sheet where the browser knows ::details-content, else by the script."""
    text = html.render(REFUSED)
    printed = text[text.index("@media print") :]
    assert re.search(r"details::details-content \{ content-visibility: visible; block-size: auto; \}", printed)
    assert 'addEventListener("beforeprint"' in text


def test_print_begins_with_what_was_lost_and_what_to_do_and_has_the_rest_as_an_appendix():
    """A report printed 27 pages, the build log first; points and advice were between its pages."""
    page = html.render(broken(load(RUBRIC)))
    parts = [
        "<h2>What to do first</h2>",
        "<h2>All requirements</h2>",
        'class="appendix"',
        'id="build-failed"',
        'id="F1"',
    ]
    places = [page.index(part) for part in parts]
    assert places == sorted(places)
    printed = page[places[0] : places[2]]
    assert "<strong>I1" in printed
    assert len(re.findall(r'<span class="num">', printed)) == len(load(RUBRIC).requirements)
    style = (html.HERE / "style.css").read_text()
    screen, _, paper = style.partition("@media print")
    assert ".printed { display: none; }" in screen
    assert ".printed { display: block; }" in paper
    assert re.search(r"\.appendix \{[^}]*break-before: page", paper)


def test_the_first_printed_pages_hold_no_more_than_fits_on_two():
    """However much was lost and however long the messages are."""
    whole = load(RUBRIC)
    long = [CheckResult(c.id, Outcome.FAILED, 0.0, "it works", "seen " * 200, "", "try " * 200) for c in whole.checks]
    page = html.render(grading(whole, long))
    printed = page.partition('class="printed"')[2].partition('class="appendix"')[0]
    assert len(re.findall("<li><strong>", printed)) == html.FIRST_STEPS
    assert len(re.sub("<[^>]*>", "", printed)) < 6000  # characters, at about 4000 on a page


def test_the_seed_is_the_instructors(rubric):
    """It decides speeds, places and noise of the trials."""
    made = grading(rubric, results(rubric), seed=8_712_345)
    assert "8712345" not in html.render(made)
    assert "8712345" not in html.render(replace(REFUSED, seed=8_712_345))
    assert data.as_data(made)["seed"] == 8_712_345


def test_what_was_measured_is_shown_where_a_check_passed(rubric):
    passed = CheckResult("check_navigation::test_reaches_a_target", Outcome.PASSED, 1.0, "reaches it", "0.04 m off")
    assert '<span class="seen">0.04 m off</span>' in html.render(grading(rubric, results(rubric, passed)))


def test_a_report_says_who_handed_in_what_and_by_what_it_was_graded(rubric):
    made = grading(
        rubric, results(rubric), rubric_title=rubric.title, commit="c0ffee", rescored="tomorrow",
        graded="2026-11-22 15:00:00+01:00", environment={"ros2-course-kit": "0.1.0"},
    )  # fmt: skip
    text = html.render(replace(made, rubric=rubric.sha256), HAND_IN)
    rows = dict(re.findall(r'<tr><th scope="row">(.*?)</th><td>(.*?)</td></tr>', text))
    assert rows["graded"] == "2026-11-22 15:00:00+01:00"
    assert (rows["judged again"], rows["people"], rows["team"]) == ("tomorrow", "Jane Doe, Li Wu", "team07")
    assert (rows["handed in"], rows["SHA-256"]) == (HAND_IN.name, INTAKE.sha256)
    assert (rows["submitted"], rows["deadline"], rows["late"]) == (HAND_IN.submitted, HAND_IN.deadline, HAND_IN.late)
    assert (rows["package graded"], rows["rubric"]) == ("team07", "A small rubric")
    assert (rows["SHA-256 of the rubric"], rows["kit"], rows["commit"]) == (rubric.sha256, "0.1.0", "c0ffee")
    assert "<li><strong>F8</strong>: 1.5 points, by A. Lovelace: the target stood in a wall</li>" in text
    assert "1 started day late: 0.65 points deducted" in text
    assert "5.85 of 10" in re.sub(r"<[^>]+>", "", text)


def test_after_a_decision_bar_badge_level_and_big_number_follow_it(rubric):
    """Only the requirement's points did; the bar, its level, the badge and the large number were the grader's."""
    missed = CheckResult("check_navigation::test_reaches_a_target", Outcome.FAILED, 0.0, "reaches it", "turned about")
    made = grading(rubric, results(rubric, missed))
    before, after = html.render(made), html.render(made, HAND_IN)
    shown = [
        (
            re.search(r'<div class="score">(.*?) <', page)[1],
            re.search(r'<rect width="(.*?)%"', page)[1],
            re.search(r'aria-label="level (.)"', page)[1],
            re.search(r'id="F8".*?class="badge (\w+)"', page, re.DOTALL)[1],
        )
        for page in (before, after)
    ]
    assert shown == [("5", "62.5", "C", "failed"), ("5.85", "81.2", "B", "partial")]
    assert "<del>0</del> 1.5 / 3" in after
    assert "5 of 8 measured" in " ".join(after.split())


def test_points_by_a_person_end_a_requirement_that_nothing_judges(rubric):
    decision = Decision(rubric.requirements[-1].id, rubric.requirements[-1].points, "well done", "Ada")
    page = html.render(grading(rubric, results(rubric)), HandIn(decisions=(decision,)))
    name = decision.requirement
    assert re.search(rf'id="{name}".*?class="badge (\w+)"', page, re.DOTALL)[1] == "passed"
    assert "<del>" not in page
    assert "are graded so far" not in page


def test_a_criterion_without_requirements_is_shown(rubric):
    """`requirements: []`, as in a rubric that is being written, ended the report with an error."""
    empty = replace(rubric.criteria[0], id="more", title="More", points=0.0, requirements=())
    whole = replace(rubric, criteria=(*rubric.criteria, empty))
    made = grading(whole, results(whole))
    assert '<section class="criterion" id="more"' in html.render(made)
    assert "More" in console.render(made)


def test_a_report_is_titled_by_person_and_assignment(rubric):
    """A browser with ten reports had ten tabs that said robot.zip."""
    made = grading(rubric, results(rubric), rubric_title=rubric.title)
    for hand_in, who in ((HandIn(("Jane Doe",)), "Jane Doe"), (HAND_IN, "team07"), (None, made.submission)):
        page = html.render(made, hand_in)
        assert re.search(r"<title>.* · (.*) · A small rubric</title>", page)[1] == who
        assert f"<h1>{who}</h1>" in page
    page = html.render(replace(REFUSED, rubric_title=rubric.title), HandIn(("Jane Doe",)))
    assert "<title>could not be graded · Jane Doe · A small rubric</title>" in page
    assert "<h1>Jane Doe</h1>" in page


def test_each_fault_is_shown_with_the_tests_that_noticed_it_or_not():
    page = html.render(mediocre(load(RUBRIC)), pictures=False)
    table = page[page.index("Mutants of the package, and") :]
    table = table[: table.index("</details>")]
    assert "the tests that noticed them (2 of 4)" in table
    rows = [re.sub(r"<[^>]+>", " ", row).split() for row in re.findall(r"<tr.*?</tr>", table)[1:]]
    assert [" ".join(row) for row in rows] == [
        "robot_controller.py:41 &lt; became &lt;= "
        "not noticed by test_stops , test_turns_left , test_keeps_the_limit and 1 more",
        "robot_controller.py:57 0.5 became 1.5 noticed by test_stops",
        "robot_controller.py:58 -speed became speed noticed by test_turns_left",
        "robot_controller.py:90 self._publish_feedback(distance) was left out no test reaches this line",
        "utils/conversions.py:7 min became max not tried",
    ]
    assert "not tried: the budget of 20 s" in table
    assert "Mutants of the package, and" not in html.render(broken(load(RUBRIC)), pictures=False)


def test_a_requirement_that_no_notebook_teaches_names_none(tmp_path):
    """A course can do without notebooks; each requirement had to name a section of one."""
    (tmp_path / "rubric.yaml").write_text(re.sub(r"(?m)^ +section: .*\n", "", SMALL))
    without = grading(found := load(tmp_path / "rubric.yaml"), results(found, TOUCHED))
    assert {requirement.section for requirement in found.requirements} == {""}
    assert "Taught in" not in html.render(without)
    assert "learn  " not in console.render(without)


def test_a_mutant_has_the_tests_that_noticed_it_or_reached_it_and_the_most_noticing_test_comes_first():
    """More tests than a line holds are counted."""
    tried = [f"t::test_{number:02}" for number in range(30)]
    mutants = [
        *(
            Mutant("a.py", 7, "f", "sign", "`-` became `+`", "noticed", by=f"t::{name}")
            for name in ("b", "c", "a", "c")
        ),
        Mutant("a.py", 9, "f", "sign", "nine", "unnoticed", tried=tried),
        Mutant("a.py", 8, "f", "sign", "eight", "noticed", by="test/x.py::TestIt::three[a::b]"),
    ]
    found = html.matrix(Mutation(0, mutants))
    assert found.noticed_by == (("c", 2), ("a", 1), ("b", 1), ("three[a::b]", 1))
    assert [(row.where, row.tests, row.others) for row in found.rows[-2:]] == [
        ("a.py:8", ("three[a::b]",), 0),
        ("a.py:9", ("test_00", "test_01", "test_02"), 27),
    ]
