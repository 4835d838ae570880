"""Each rule for notebooks holds for the example, and fails for the violation that it is meant to find."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import nbformat
import pytest
from helpers.notebook_fixtures import stored
from helpers.notebook_rules import (
    OF_PUBLISHED,
    OF_SOURCES,
    OF_STUDENTS,
    OF_UNTOUCHED_RUNS,
    Page,
    Rule,
    sections_of_the_rubric_are_there,
)
from helpers.notebook_validation import validate

from grader.authoring import book, notebook_source
from grader.scoring.rubric import Rubric

NAME = "02_example"


def page_of(folder: Path, rubric: Rubric) -> Page:
    return Page(NAME, notebook_source.read(NAME, rubric, folder), folder)


def published_in(folder: Path) -> Page:
    return stored(book.published_file(NAME, folder))


def rule_named(name: str) -> Rule:
    return next(rule for rule in (*OF_STUDENTS, *OF_PUBLISHED, *OF_UNTOUCHED_RUNS) if rule.__name__ == name)


def edit(folder: Path, old: str, new: str) -> None:
    source = folder / "source" / f"{NAME}.py"
    text = source.read_text()
    assert old in text
    source.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    "rule", dict.fromkeys((*OF_SOURCES, *OF_STUDENTS, *OF_PUBLISHED)), ids=lambda rule: rule.__name__
)
def test_the_example_keeps_the_rule(rule: Rule, example: Path, rubric: Rubric):
    if rule in OF_SOURCES:
        assert list(rule(page_of(example, rubric))) == []
    if rule in OF_STUDENTS:
        assert list(rule(stored(book.student_file(NAME, example)))) == []
    if rule in OF_PUBLISHED:
        assert list(rule(published_in(example))) == []


VIOLATIONS = [
    ("has_one_title", "# # An example", "# An example"),
    ("has_one_title", "# ## Recall", "# # Recall"),
    ("opens_like_the_others", "![What will be there at the end](pictures/02.png)", "no picture"),
    ("opens_like_the_others", "**You will be able to**", "You will learn to"),
    ("opens_like_the_others", "about 5 minutes", "a while"),
    ("opens_like_the_others", "└── given.py", "given.py"),
    ("opens_like_the_others", 'begin("02")', 'begin("03")'),
    ("asks_recall_questions", "## Recall", "## Questions"),
    ("asks_recall_questions", "<details><summary>Answer</summary>Three.</details>", "Three."),
    ("folds_are_closed", "Three.</details>", "Three."),
    ("exercises_are_checked_and_hinted", "<summary>Hint 2: all but the last line</summary>", "<summary>More</summary>"),
    ("exercises_are_checked_and_hinted", '# %% tags=["check"]\ncheck("I3")', "# %%\n1"),
    ("designs_are_left_to_the_learner", '# %% tags=["exercise"]', '# %% tags=["exercise", "design"]'),
    ("tags_fit_the_cells", '# %% tags=["check"]', "# %%"),
    ("pieces_are_tried_and_hinted", "# %%\n# The piece, tried", "# %% [markdown]\n# The piece, tried"),
    ("designs_are_left_to_the_learner", '# %% tags=["piece"]', '# %% tags=["piece", "design"]'),
    ("pieces_are_tried_and_hinted", "<summary>Hint 2: the piece", "<summary>More: the piece"),
    ("unseen_tasks_stand_alone", '["piece"]\n# %%into tail.py\n', '["function", "unseen"]\n'),
    ("pieces_follow_their_skeleton", "# %%into tail.py\ndef first", "# %%into other.py\ndef first"),
    ("pieces_follow_their_skeleton", "# %%into tail.py\ndef first", "# %%into tail.py\ndef second"),
    ("steps_count_up", "# ## Recall", "# ### Step 2: more\n# ## Recall"),
    ("tags_fit_the_cells", "# %%into tail.py\n", ""),
    ("tags_fit_the_cells", '# %% tags=["piece"]', "# %%"),
    ("tags_fit_the_cells", '# %% tags=["given"]', '# %% tags=["gift"]'),
    ("tags_fit_the_cells", "# %%writefile given.py\n", ""),
    ("tags_fit_the_cells", 'check("I3")', 'check("I3")\nprint(1)'),
    ("cells_are_short", 'print("two")', "\n".join(f"print({i})" for i in range(31))),
    ("cells_are_short", "# %%into tail.py\n", "# %%into tail.py\n" + "# a line\n" * 40),
    ("code_has_no_known_slip", 'print("two")', "plt.figure(figsize=(8, 3))"),
    ("code_has_no_known_slip", 'print("two")', "# !cd .. && colcon build 2>&1 | tail -n 1"),
    ("code_has_no_known_slip", 'print("two")', "# !python3 -m pytest -q test | tail -n 3"),
    ("code_has_no_known_slip", 'print("two")', "graph_view()"),
    ("pictures_are_ours", "pictures/02.png", "pictures/missing.png"),
    ("pictures_are_ours", "pictures/02.png", "https://example.org/02.png"),
    ("links_lead_somewhere", "Predict what this shows", "See [there](source/nowhere.py)"),
    ("says_why_an_output_is_not_compared", "# Not compared: the clock is another one each time.\n", ""),
]


@pytest.mark.parametrize(("name", "old", "new"), VIOLATIONS, ids=[f"{n}-{i}" for i, (n, _, _) in enumerate(VIOLATIONS)])
def test_a_violation_breaks_the_rule(name: str, old: str, new: str, example: Path, rubric: Rubric):
    rule = next(rule for rule in OF_SOURCES if rule.__name__ == name)
    edit(example, old, new)
    assert list(rule(page_of(example, rubric))) != []


def test_a_function_that_stays_in_the_notebook_is_tried_and_hinted_like_a_piece(example: Path, rubric: Rubric):
    rule = next(rule for rule in OF_SOURCES if rule.__name__ == "pieces_are_tried_and_hinted")
    edit(example, '# %% tags=["piece"]\n# %%into tail.py\n', '# %% tags=["function"]\n')
    for check in OF_SOURCES:
        assert list(check(page_of(example, rubric))) == []
    edit(example, "<summary>Hint 2: the piece", "<summary>More: the piece")
    (problem,) = rule(page_of(example, rubric))
    assert problem.endswith("has 1 folded hints, expected 2")


def test_each_rule_for_sources_has_a_violation():
    assert {name for name, _, _ in VIOLATIONS} == {rule.__name__ for rule in OF_SOURCES}


@pytest.mark.parametrize(
    ("edits", "problems"),
    [
        ((), []),
        (
            [("## Same name, same type", "## Same name, same Type")],
            ["I3: there is no section `## Same name, same type`"],
        ),
        (
            [("(I3)", ""), ('check("I3")', 'check("I2")')],
            ["I3 is not named in its section `## Same name, same type`"],
        ),
    ],
)
def test_a_section_that_the_rubric_names_must_exist_and_name_its_requirement(
    edits: list[tuple[str, str]], problems: list[str], example: Path, rubric: Rubric
):
    for old, new in edits:
        edit(example, old, new)
    page = Page("02_interfaces", page_of(example, rubric).notebook, example)
    assert list(sections_of_the_rubric_are_there(page, rubric)) == problems


@pytest.mark.slow  # one more kernel
@pytest.mark.parametrize("rule", OF_UNTOUCHED_RUNS, ids=lambda rule: rule.__name__)
def test_the_untouched_run_of_the_example_keeps_the_rule(rule: Rule, example: Path, rubric: Rubric):
    run = book.Notebook(NAME, rubric, example).run_untouched()
    assert list(rule(Page(NAME, run.notebook, example))) == []


def test_a_students_notebook_with_an_output_breaks_the_rule(example: Path):
    page = stored(book.student_file(NAME, example))
    page.code()[1].outputs.append(nbformat.v4.new_output("stream", text="one"))
    (problem,) = rule_named("has_no_outputs")(page)
    assert problem == "cell same-name-same-type-02 has outputs or was run"


@pytest.mark.parametrize(
    ("name", "output"),
    [
        ("ran_without_an_exception", nbformat.v4.new_output("error", ename="ValueError", evalue="no", traceback=[])),
        ("ran_without_an_exception", nbformat.v4.new_output("stream", name="stderr", text="Warning: old")),
        ("tries_are_right", nbformat.v4.new_output("stream", text="NOT YET  ramp(0.0, 0.5, 0.1)  0, wanted 0.1\n")),
        ("outputs_name_no_machine", nbformat.v4.new_output("stream", text="wrote /home/me/ws/x")),
        ("outputs_name_no_machine", nbformat.v4.new_output("stream", text="[INFO] [1763731234.123456789] [node]: on")),
        ("outputs_name_no_machine", nbformat.v4.new_output("display_data", data={"text/html": "<p>/tmp/x</p>"})),
        ("pictures_have_words", nbformat.v4.new_output("display_data", data={"image/png": "AAAA"})),
        (
            "drives_are_repeatable",
            nbformat.v4.new_output(
                "display_data",
                data={"image/png": "AAAA"},
                metadata={"image/png": {"alt": "wall_ahead. Perhaps not repeatable: the node was busy."}},
            ),
        ),
    ],
)
def test_an_output_breaks_the_rule(name: str, output: nbformat.NotebookNode, example: Path):
    page = published_in(example)
    page.code()[1].outputs.append(output)
    assert list(rule_named(name)(page)) != []


def test_a_check_that_passes_untouched_breaks_the_rule(example: Path):
    rule = rule_named("checks_say_not_yet")
    assert list(rule(published_in(example))) == ["I3: the check of an untouched notebook does not say `I3 not yet`"]


def test_a_check_that_does_not_pass_solved_breaks_the_rule(example: Path):
    page = published_in(example)
    (checked,) = [cell for cell in page.code() if notebook_source.checked(cell)]
    checked.outputs[0].text = "I3 not yet (0 of 5)"
    found = list(rule_named("checks_say_passed")(page))
    assert found == ["I3: the check of a solved notebook does not say `I3 passed`"]


def test_a_large_notebook_breaks_the_rule(example: Path):
    page = published_in(example)
    page.code()[1].outputs.append(nbformat.v4.new_output("stream", text="x" * 2_000_000))
    book.write(page.notebook, book.published_file(NAME, example))
    assert list(rule_named("is_small")(page)) == ["is 2.0 MB large, more than 1.5"]


@pytest.mark.slow  # nbval runs; so it does on the two notebooks of `make test`
def test_nbval_reproduces_the_published_outputs(example: Path, tmp_path: Path):
    """Also where a semicolon keeps a value from being shown."""
    found = validate(book.published_file(NAME, example), tmp_path / "ws")
    assert found.problems == ()
    assert found.cells == len(published_in(example).code())


@pytest.mark.slow  # nbval runs; so it does on the two notebooks of `make test`
def test_nbval_notices_an_exception_and_a_wrong_published_output(example: Path, tmp_path: Path):
    page = published_in(example)
    page.code()[1].outputs[0].text = "one\nthree\n"
    page.code()[2].source = "raise ValueError('no')"
    book.write(page.notebook, book.published_file(NAME, example))
    different, raised = validate(book.published_file(NAME, example), tmp_path / "ws").problems
    assert different.startswith("Cell 1: ")
    assert "three" in different
    assert "ValueError: no" in raised


def test_a_solved_notebook_whose_check_does_not_pass_is_not_published(example: Path, notebook: book.Notebook):
    before = book.published_file(NAME, example).read_bytes()
    wrong = replace(notebook, solutions=lambda name, path: notebook.solutions(name, path).replace("= 42", "= 41"))
    assert wrong.publish().error == "02_example: solved, but these checks do not pass: I3"
    assert book.published_file(NAME, example).read_bytes() == before
