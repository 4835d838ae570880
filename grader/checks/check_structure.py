"""Q3: layout, complexity, conversions in their place, repeated blocks."""

from grader.checks.findings import MOST_SHOWN, listing, place, some
from grader.checks.judge import Judge
from grader.checks.package_text import (
    charge,
    readable,
    unread_files,
    unread_lines,
    unread_share,
    weighed,
    within_bounds,
)
from grader.contract.layout import LAYOUT, layout_of
from grader.contract.spec import CONVERSIONS, PACKAGE


def test_layout_matches_the_contract(judge: Judge) -> None:
    """The package has the contract's layout; each missing path costs a share."""
    paths = set(within_bounds(judge).paths)
    missing = [path for path in layout_of(paths, judge.evidence.intake.package) if path not in paths]
    if missing:
        seen = f"missing: {some(missing, len(LAYOUT))}"
        meant = [_similar(path, paths) for path in missing]
        near = [path for path in dict.fromkeys(meant) if path]
        seen += f"; perhaps meant: {some(near)}" if near else ""
        judge.share(1 - len(missing) / len(LAYOUT), seen, "compare the names and folders with the contract's tree")


def test_no_function_is_too_complex(judge: Judge) -> None:
    """No function has a cyclomatic complexity above 10; each one that has costs a quarter."""
    found = weighed(judge).complex
    words = [f"{len(found)} {'function' if len(found) == 1 else 'functions'} above 10", listing(found)]
    charge(judge, len(found), 4, words, "move each decision into a function of its own")


def test_conversions_are_in_utils_and_used(judge: Judge) -> None:
    """The conversions are in `utils/`, and the nodes use them instead of converting by hand."""
    quality = readable(judge)
    found = quality.conversions
    missing = [name for name in CONVERSIONS if name not in found.defined]
    words = []
    share = 1.0
    if missing:
        words.append(f"utils/conversions.py does not define {', '.join(missing)}")
        share -= 0.5 * len(missing) / len(CONVERSIONS)
    if not found.calls:
        words.append("no node calls a function of utils/conversions.py, directly or through another module")
        share -= 0.5
    if found.elsewhere:
        words += [f"{place(finding)} {finding.text}" for finding in found.elsewhere[:MOST_SHOWN]]
        share -= 0.25 * len(found.elsewhere)
    unread = unread_files(judge)
    if unread:
        words += unread_lines(unread)
        share -= unread_share(judge, unread)
    if words:
        judge.share(share, "\n".join(words), f"import them: from {PACKAGE}.utils.conversions import normalize_angle")


def test_no_block_is_repeated(judge: Judge) -> None:
    """No block of six or more lines is repeated in the package; each one that is costs a quarter."""
    copies = weighed(judge).copies
    shown = [f"{copy.lines} lines: {' = '.join(copy.places)}" for copy in copies[:MOST_SHOWN]]
    words = [f"{len(copies)} {'block occurs' if len(copies) == 1 else 'blocks occur'} more than once", *shown]
    charge(judge, len(copies), 4, words, "make the block a function in utils/, so that a bug is fixed in one place")


def _similar(path: str, paths: set[str]) -> str:
    """Return a path with the same or nearly the same name as a missing one, "" if there is none."""
    name = path.rpartition("/")[2].lower()
    plain = name.replace("_", "").replace(".", "").replace("-", "")
    # What has its place in the layout is no misspelling of something else.
    for other in sorted(paths - set(LAYOUT)):
        theirs = other.rpartition("/")[2].lower()
        if name != "__init__.py" and plain == theirs.replace("_", "").replace(".", "").replace("-", ""):
            return other
    return ""
