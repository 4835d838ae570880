"""Rules for every notebook of the course: functions from a notebook to its violations, one sentence each.

They are separate from the tests, so that `test_notebook_rules.py` can show on a small example that each can fail.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from nbformat import NotebookNode

from grader.authoring import notebook_run, notebook_source
from grader.notebook import lanes, pieces
from grader.scoring.rubric import Rubric

# Lines of code that are not blank; plots need more than the usual. What writes a file may have up to FOLDED_LINES.
LONGEST_CELL, USUAL_CELL = 30, 8
MOST_BYTES = 1_500_000  # of a notebook with its pictures: code-hosting sites stop showing larger ones
HINTS = 2  # what is needed, and all but the last line; a design has no hint of the second kind
RECALL = 3
UNSEEN_WORDS = 150
ALL_BUT_ONE = re.compile(r"<summary>Hint[^<]*all but the last line")
IGNORED = "nbval-ignore-output"

# The tags of cells that write a file of the package, or into one, or a function of the notebook.
_PIECES = {notebook_source.PIECE, notebook_source.FUNCTION}
_OTHERS = {
    notebook_source.CHECK,
    notebook_source.DESIGN,
    notebook_source.UNSEEN,
    notebook_source.CASE,
    lanes.WHOLE,
    IGNORED,
}
WRITTEN = {notebook_source.EXERCISE, notebook_source.SKELETON, notebook_source.GIVEN, *_PIECES}

# Traces of this machine, this day or this process in an output.
MACHINE = re.compile(
    r"\bat 0x[0-9a-f]{6}|/tmp/|/root\b|/home/\w|/work/|/usr/(?!bin/env)|/Users/|\bpid[ =:]+\d|\b1[6-9]\d{8}\.\d{3,}"
    r"|\b20[2-9]\d-\d\d-\d\d"
)

# A node's log goes to stderr too, and a cell may be meant to show it.
LOGGED = re.compile(r"(\[(INFO|WARN|ERROR|FATAL)\] \[.*\n?)+")


@dataclass(frozen=True)
class Page:
    """A notebook with its name and its folder; `notebook` may hold stored outputs."""

    name: str
    notebook: NotebookNode
    folder: Path

    @property
    def number(self) -> str:
        return self.name[:2]

    def opening(self) -> str:
        """Return the markdown before the first section that has code."""
        texts = []
        for cell in self.notebook.cells:
            if cell.cell_type == "code":
                break
            texts.append(cell.source)
        return "\n".join(texts)

    def markdown(self) -> str:
        return "\n\n".join(cell.source for cell in self.notebook.cells if cell.cell_type == "markdown")

    def code(self) -> list[NotebookNode]:
        return [cell for cell in self.notebook.cells if cell.cell_type == "code"]


Rule = Callable[[Page], Iterator[str]]
_LINK = re.compile(r"!\[[^\]]*\]\(([^)\s]+)[^)]*\)|<img[^>]*\ssrc=\"([^\"]+)\"")


def sections(notebook: NotebookNode) -> dict[str, list[NotebookNode]]:
    """Return the cells below each `## ` heading."""
    found: dict[str, list[NotebookNode]] = {}
    here: list[NotebookNode] = []
    for cell in notebook.cells:
        for level, heading in notebook_source.headings(cell):
            if level == 2:
                here = found.setdefault(heading, [])
        here.append(cell)
    return found


def pictures(cell: NotebookNode) -> list[str]:
    """Return the targets of the pictures in a markdown cell."""
    return [a or b for a, b in _LINK.findall(cell.source)] if cell.cell_type == "markdown" else []


def has_one_title(page: Page) -> Iterator[str]:
    titles = [text for cell in page.notebook.cells for level, text in notebook_source.headings(cell) if level == 1]
    if len(titles) != 1:
        yield f"has {len(titles)} titles: {titles}"
    first = page.notebook.cells[0].source if page.notebook.cells else ""
    if not first.startswith("# "):
        yield "does not begin with its title"


def opens_like_the_others(page: Page) -> Iterator[str]:
    """The tree of the package applies from notebook 02 on: before, it is empty."""
    opening, first = page.opening(), page.code()[0].source if page.code() else ""
    if f"pictures/{page.number}.png" not in [p for cell in page.notebook.cells[:3] for p in pictures(cell)]:
        yield f"does not show pictures/{page.number}.png among its first three cells"
    if "you will be able to" not in opening.lower():
        yield 'does not say "You will be able to" before its first code'
    if not re.search(r"\b(\d+|a|an hour) +(minutes?|min|hours?)\b", opening):
        yield "does not say before its first code how many minutes it takes"
    if page.number > "01" and "── " not in page.markdown():
        yield "shows no tree of what the package holds so far"
    if f'begin("{page.number}")' not in first:
        yield f'its first code cell does not call begin("{page.number}")'


def asks_recall_questions(page: Page) -> Iterator[str]:
    titles = [t for t in sections(page.notebook) if re.search("recall|remember", t, re.IGNORECASE)]
    if not titles:
        yield 'has no section whose title has "recall" or "remember" in it'
        return
    text = "\n".join(cell.source for cell in sections(page.notebook)[titles[-1]])
    if (found := text.count("<details")) < RECALL:
        yield f"{titles[-1]}: {found} folded answers, expected {RECALL} or more"


def folds_are_closed(page: Page) -> Iterator[str]:
    for cell in page.notebook.cells:
        if cell.cell_type == "markdown":
            counts = [cell.source.count(mark) for mark in ("<details", "</details>", "<summary>", "</summary>")]
            if len(set(counts)) != 1:
                yield f"cell {cell['id']}: {counts[0]} <details>, {counts[1]} closed, {counts[2]} summaries"


def exercises_are_checked_and_hinted(page: Page) -> Iterator[str]:
    """Exercises without a check between them share the next check and its hints; a skeleton's pieces have their own."""
    open_: dict[str, int] = {}  # what is written, and how many hints it needs
    hints, asked, of_a_piece = 0, True, False
    for cell in [*page.notebook.cells, None]:
        tags = set(notebook_source.tags(cell)) if cell is not None else set()
        exercise = bool({notebook_source.EXERCISE, notebook_source.SKELETON} & tags)
        if (cell is None or exercise) and open_ and (asked or cell is None):
            if not asked:
                yield f"no check follows the exercise {', '.join(open_)}"
            if hints < (expected := max(open_.values())):
                yield f"the exercise {', '.join(open_)} has {hints} folded hints, expected {expected}"
            open_ = {}
        if cell is None:
            return
        if exercise:
            hints, asked = (0, False) if not open_ else (hints, asked)
            needed = HINTS - (notebook_source.DESIGN in tags) if notebook_source.EXERCISE in tags else 0
            open_[notebook_source.written_file(cell) or cell["id"]] = needed
        of_a_piece = (of_a_piece or notebook_source.PIECE in tags) and not exercise
        asked = asked or notebook_source.CHECK in tags
        if cell.cell_type == "markdown" and not of_a_piece:
            hints += len(re.findall(r"<summary>[^<]*hint", cell.source, re.IGNORECASE))


def cells_after(page: Page, position: int, ends: set[str]) -> list[NotebookNode]:
    """Return the cells after one, up to the next with one of these tags."""
    after = page.notebook.cells[position + 1 :]
    end = next((n for n, cell in enumerate(after) if ends & set(notebook_source.tags(cell))), len(after))
    return after[:end]


def designs_are_left_to_the_learner(page: Page) -> Iterator[str]:
    """Up to the next exercise: no skeleton, no hint that is all but a line, and two worked designs afterwards."""
    for position, cell in enumerate(page.notebook.cells):
        tags = set(notebook_source.tags(cell))
        if notebook_source.DESIGN not in tags:
            continue
        exercise = notebook_source.EXERCISE in tags
        if exercise and pieces.definitions(notebook_source.body(cell)):
            yield f"the design {cell['id']} is a skeleton: it names functions"
        ends = {notebook_source.EXERCISE, notebook_source.SKELETON}
        own = cells_after(page, position, ends if exercise else WRITTEN)
        later = own if exercise else page.notebook.cells[position:]
        told = any(ALL_BUT_ONE.search(other.source) for other in own)
        if told or not any("<summary>Two designs" in other.source for other in later):
            yield f"the design {cell['id']} has a hint of all but a line, or no two designs to compare it with"


def pieces_are_tried_and_hinted(page: Page) -> Iterator[str]:
    """Each piece of a file can be tried on the spot, and has hints of its own."""
    for position, cell in enumerate(page.notebook.cells):
        tags = set(notebook_source.tags(cell))
        if not _PIECES & tags or notebook_source.UNSEEN in tags:
            continue
        after = cells_after(page, position, WRITTEN)
        if not any(other.cell_type == "code" for other in after):
            yield f"the piece {cell['id']} is not tried before the next file or piece"
        hints = sum(len(re.findall(r"<summary>[^<]*hint", o.source, re.IGNORECASE)) for o in after)
        if hints < (expected := HINTS - (notebook_source.DESIGN in tags)):
            yield f"the piece {cell['id']} has {hints} folded hints, expected {expected}"


def unseen_tasks_stand_alone(page: Page) -> Iterator[str]:
    """A section of its own: a short text, one cell to write in, and the check."""
    for title, cells in sections(page.notebook).items():
        unseen = [notebook_source.UNSEEN in notebook_source.tags(cell) for cell in cells]
        if any(unseen):
            if unseen != [False, True, False] or notebook_source.CHECK not in notebook_source.tags(cells[2]):
                yield f"{title}: an unseen task is its text, one cell to write in and its check"
            if (words := len(cells[0].source.split())) > UNSEEN_WORDS or "<details" in cells[0].source:
                yield f"{title}: {words} words, or a hint; at most {UNSEEN_WORDS} words, and no hint"


def pieces_follow_their_skeleton(page: Page) -> Iterator[str]:
    written: dict[str, set[str]] = {}
    for cell in page.code():
        if notebook_source.SKELETON in notebook_source.tags(cell) and (path := notebook_source.written_file(cell)):
            written[path] = {found.name for found in pieces.definitions(notebook_source.body(cell))}
        elif path := notebook_source.piece_file(cell):
            for found in pieces.definitions(notebook_source.body(cell)):
                if found.name not in written.get(path, set()):
                    yield f"the piece {cell['id']}: {found.name} is not in a skeleton of {path} above"


def steps_count_up(page: Page) -> Iterator[str]:
    """Exercises, steps, pieces and tables count up by one; only a new list of them begins at 1 again."""
    last: dict[str, int] = {}
    for cell in page.notebook.cells:
        if cell.cell_type == "markdown":
            pattern = r"^(?:#+ |\*\*)?(Exercise|Step|Piece|Table) (\d+)[:,]"
            for kind, number in re.findall(pattern, cell.source, re.MULTILINE):
                if int(number) not in (1, last.get(kind, 0) + 1):
                    yield f"cell {cell['id']}: {kind} {number} follows {kind} {last.get(kind, 0)}"
                last[kind] = int(number)


def tags_fit_the_cells(page: Page) -> Iterator[str]:
    for cell in page.notebook.cells:
        tags = set(notebook_source.tags(cell))
        if unknown := tags - WRITTEN - _OTHERS:
            yield f"cell {cell['id']} has the unknown tag {', '.join(sorted(unknown))}"
        if WRITTEN & tags - _PIECES and notebook_source.written_file(cell) is None:
            yield f"cell {cell['id']} is tagged {', '.join(sorted(tags))} but does not begin with %%writefile"
        if (notebook_source.PIECE in tags) != cell.source.startswith(f"%%{pieces.MAGIC} "):
            yield f"cell {cell['id']}: the tag `piece` and %%{pieces.MAGIC} belong together"
        if cell.cell_type == "code" and bool(notebook_source.checked(cell)) != (notebook_source.CHECK in tags):
            yield f"cell {cell['id']}: the tag `check` and a call of check() belong together"
        if notebook_source.CHECK in tags and not re.fullmatch(r"(#.*\n)*check\([^)]*\);?", cell.source.strip()):
            yield f"cell {cell['id']}: a check must be alone in its cell"
        if notebook_source.CHECK in tags and IGNORED in tags:
            yield f"cell {cell['id']}: a check's answer to an untouched notebook is the same everywhere; compare it"


def cells_are_short(page: Page) -> Iterator[str]:
    """A cell that writes a whole file may be longer than a screen if it is folded."""
    lines: dict[str, int] = {}
    for cell in page.code():
        count = notebook_source.lines(cell)
        written = WRITTEN & set(notebook_source.tags(cell))
        if not written:
            lines[cell["id"]] = count
        longest = notebook_source.FOLDED_LINES if written else LONGEST_CELL
        if count > longest and not cell.metadata.get("jupyter", {}).get("source_hidden"):
            yield f"cell {cell['id']} has {count} lines, more than {longest}: split it, with prose between, or fold it"
    if lines and (usual := median(lines.values())) > USUAL_CELL:
        yield f"half of its code cells have {usual:g} lines or more, expected {USUAL_CELL} at most"


# Code, and what is wrong with it.
SLIPS = {
    r"\bplt\.(?:figure|subplots)\((?!(?:[^()]|\([^()]*\))*layout=\"constrained\")":
        'labels may lie outside of the picture, without layout="constrained"',
    r"(?:colcon (?:build|test)|-m pytest(?!.* -k )).*\| *tail":
        "`tail` hides for a minute how far it is; pipe it into `cat`",
    r"graph_view\(\)": "the graph is drawn before its nodes are there: graph_view(nodes=2)",
}  # fmt: skip


def code_has_no_known_slip(page: Page) -> Iterator[str]:
    for cell in page.code():
        yield from (f"cell {cell['id']}: {words}" for slip, words in SLIPS.items() if re.search(slip, cell.source))


def pictures_are_ours(page: Page) -> Iterator[str]:
    for cell in page.notebook.cells:
        for target in pictures(cell):
            if re.match(r"\w+:|//", target):
                yield f"cell {cell['id']} shows a picture from the network: {target}"
            elif not (page.folder / target).is_file():
                yield f"cell {cell['id']} shows {target}, which does not exist"


def links_lead_somewhere(page: Page) -> Iterator[str]:
    for cell in page.notebook.cells:
        if cell.cell_type != "markdown":
            continue
        for target in re.findall(r"(?<!!)\[[^\]]*\]\(([^)\s]+)\)", cell.source):
            path, _, _section = target.partition("#")
            made = page.folder / "source" / path.replace(".ipynb", ".py")
            if path and not re.match(r"\w+:", path) and not ((page.folder / path).exists() or made.exists()):
                yield f"cell {cell['id']} links to {target}, which does not exist"


def sections_of_the_rubric_are_there(page: Page, rubric: Rubric) -> Iterator[str]:
    """Each requirement is taught where rubric.yaml says, and named there."""
    found = sections(page.notebook)
    for requirement in rubric.requirements:
        name, _, title = requirement.section.partition("#")
        if name != page.name:
            continue
        if title not in found:
            yield f"{requirement.id}: there is no section `## {title}`"
        elif not any(re.search(rf"\b{requirement.id}\b", cell.source) for cell in found[title]):
            yield f"{requirement.id} is not named in its section `## {title}`"


# Rules for the student edition.


def has_no_outputs(page: Page) -> Iterator[str]:
    """What a question asks for must not stand below it."""
    for cell in page.code():
        if cell.outputs or cell.execution_count is not None:
            yield f"cell {cell['id']} has outputs or was run"


# Rules for a notebook that was run.


def ran_without_an_exception(page: Page) -> Iterator[str]:
    for cell in page.code():
        if cell.execution_count is None:
            yield f"cell {cell['id']} was not run"
        for output in cell.outputs:
            if output.output_type == "error":
                yield f"cell {cell['id']} raised {output.ename}: {output.evalue}"
            elif output.output_type == "stream" and output.name == "stderr" and not LOGGED.fullmatch(output.text):
                yield f"cell {cell['id']} wrote to stderr, which readers take for an error: {output.text[:200]!r}"


def checks_say_not_yet(page: Page) -> Iterator[str]:
    for name in notebook_run.answered_otherwise(page.notebook, "not yet"):
        yield f"{name}: the check of an untouched notebook does not say `{name} not yet`"


def checks_say_passed(page: Page) -> Iterator[str]:
    for name in notebook_run.answered_otherwise(page.notebook):
        yield f"{name}: the check of a solved notebook does not say `{name} passed`"


def tries_are_right(page: Page) -> Iterator[str]:
    """Cells that try a function on a table of cases print NOT YET beside a case that is wrong."""
    for cell in notebook_run.cells_not_yet(page.notebook):
        yield f"cell {cell} says NOT YET"


def outputs_name_no_machine(page: Page) -> Iterator[str]:
    for cell in page.code():
        for output in cell.outputs:
            texts = [output.get("text", ""), *(v for v in output.get("data", {}).values() if isinstance(v, str))]
            for text in texts:
                if match := MACHINE.search(re.sub(r"base64,[A-Za-z0-9+/=\s]+", "", text)):
                    around = text[max(0, match.start() - 40) : match.end() + 40]
                    yield f"cell {cell['id']}: an output shows where or when it was made: {around!r}"
                    break


def pictures_have_words(page: Page) -> Iterator[str]:
    """Those who do not see a picture are told what it shows."""
    for cell in page.notebook.cells:
        if "![](" in cell.source or any(
            "image/png" in output.get("data", {}) and not output.metadata.get("image/png", {}).get("alt")
            for output in cell.get("outputs", ())
        ):
            yield f"cell {cell['id']} shows a picture without an alternative text"


def drives_are_repeatable(page: Page) -> Iterator[str]:
    """A machine that was too busy while the page was made shows a drive that nobody sees again.

    A node that sends no feedback yet, in notebook 07, is run in real time on any machine.
    """
    for cell in page.code():
        for output in cell.outputs:
            words = output.get("metadata", {}).get("image/png", {}).get("alt", "")
            if re.search(r"\bnot repeatable:(?! the node sent no feedback)", words, re.IGNORECASE):
                yield f"cell {cell['id']} shows a drive that is not repeatable: run it again on a quiet machine"


def says_why_an_output_is_not_compared(page: Page) -> Iterator[str]:
    for cell in page.code():
        if IGNORED in notebook_source.tags(cell) and not re.search(
            r"^ *#(?! *%%)(.*\w+){3}", cell.source, re.MULTILINE
        ):
            yield f"cell {cell['id']} is tagged {IGNORED} without a comment that says why"


def is_small(page: Page) -> Iterator[str]:
    path = page.folder / f"{page.name}.ipynb"
    if path.exists() and (size := path.stat().st_size) > MOST_BYTES:
        yield f"is {size / 1e6:.1f} MB large, more than {MOST_BYTES / 1e6:.1f}"


OF_SOURCES: tuple[Rule, ...] = (
    has_one_title,
    opens_like_the_others,
    asks_recall_questions,
    folds_are_closed,
    exercises_are_checked_and_hinted,
    designs_are_left_to_the_learner,
    pieces_are_tried_and_hinted,
    unseen_tasks_stand_alone,
    pieces_follow_their_skeleton,
    steps_count_up,
    tags_fit_the_cells,
    cells_are_short,
    code_has_no_known_slip,
    pictures_are_ours,
    links_lead_somewhere,
    says_why_an_output_is_not_compared,
)
OF_STUDENTS: tuple[Rule, ...] = (has_no_outputs, is_small)
OF_UNTOUCHED_RUNS: tuple[Rule, ...] = (ran_without_an_exception, checks_say_not_yet)
OF_PUBLISHED: tuple[Rule, ...] = (
    ran_without_an_exception,
    checks_say_passed,
    tries_are_right,
    outputs_name_no_machine,
    is_small,
    pictures_are_ours,
    pictures_have_words,
    drives_are_repeatable,
    links_lead_somewhere,
)
