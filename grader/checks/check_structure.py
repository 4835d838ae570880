"""Layout, complexity, functions in their place, repeated blocks."""

import difflib

from grader.checks import package_text
from grader.checks.judge import Judge
from grader.checks.package_text import charge, measured, readable, weighed, within_bounds
from grader.checks.wording import listing, place
from grader.words import MOST_SHOWN, say, say_count, some

NEEDS = ("quality", "linters", "what ran")


def test_layout_matches_the_contract(judge: Judge) -> None:
    """The package has the contract's layout; each missing path costs a share."""
    course, paths = judge.course, set(within_bounds(judge).paths)
    missing = [path for path in course.layout_of(paths, judge.evidence.intake.package) if path not in paths]
    if missing:
        seen = say("missing: {missing}", missing=some(missing, len(course.layout)))
        # What has a place of its own in the layout is no misspelling of something else.
        others = {path.rpartition("/")[2].lower(): path for path in sorted(paths - {*course.layout}, reverse=True)}
        names = [path.rpartition("/")[2].lower() for path in missing if not path.endswith("/__init__.py")]
        meant = [others[near] for name in names for near in difflib.get_close_matches(name, others, 1, 0.9)]
        seen += say("; perhaps meant: {near}", near=some([*dict.fromkeys(meant)])) if meant else ""
        try_ = say("compare the names and folders with the contract's tree")
        judge.share(1 - len(missing) / len(course.layout), seen, try_)


def test_no_function_is_too_complex(judge: Judge) -> None:
    """No function has a cyclomatic complexity above 10; each one that has costs a quarter."""
    found = measured(judge, weighed(judge).complex)
    words = [say_count("{n} function above 10", "{n} functions above 10", len(found)), listing(found)]
    charge(judge, len(found), 4, words, say("move each decision into a function of its own"))


def expect_functions_used(judge: Judge) -> None:
    """Give the share of the contract's functions that are in their module, if the nodes use it and nothing else."""
    quality, functions = readable(judge), judge.course.functions
    assert functions is not None, "the contract names no functions"
    found, path = quality.functions, functions.module.partition("/")[2]
    calls, elsewhere = measured(judge, found.calls), measured(judge, found.elsewhere)
    missing = [name for name in functions.names if name not in found.defined]
    words = []
    share = 1.0
    if missing:
        words.append(say("{path} does not define {missing}", path=path, missing=", ".join(missing)))
        share -= 0.5 * len(missing) / len(functions.names)
    unread = package_text.unread_files(judge)
    if not calls and not unread:  # else the calls may be where nobody can read them
        words.append(say("no node calls a function of {path}, directly or through another module", path=path))
        share -= 0.5
    if elsewhere:
        words += [f"{place(finding)} {finding.text}" for finding in elsewhere[:MOST_SHOWN]]
        share -= 0.25 * len(elsewhere)
    if unread:
        words += package_text.unread_lines(unread)
        share -= max(package_text.unread_share(judge, unread), 0.0 if calls else 0.5)
    if words:
        module = functions.module.removesuffix(".py").replace("/", ".")
        try_ = say("import them: from {module} import {name}", module=module, name=functions.names[0])
        judge.share(share, "\n".join(words), package_text.readable_first(unread, try_))


def test_functions_are_in_their_module_and_used(judge: Judge) -> None:
    """The contract's functions are in their module, and the nodes use them instead of doing the same by hand."""
    expect_functions_used(judge)


def test_no_block_is_repeated(judge: Judge) -> None:
    """No block of six or more lines is repeated in the package; each one that is costs a quarter."""
    copies = [(copy.lines, [at for at in copy.places if _counts(judge, at)]) for copy in weighed(judge).copies]
    repeated = [(lines, places) for lines, places in copies if len(places) > 1]
    words = [say_count("{n} block occurs more than once", "{n} blocks occur more than once", len(repeated))]
    for lines, places in repeated[:MOST_SHOWN]:
        words.append(say("{lines} lines: {places}", lines=lines, places=" = ".join(places)))
    try_ = say("make the block a function in utils/, so that a bug is fixed in one place")
    charge(judge, len(repeated), 4, words, try_)


def _counts(judge: Judge, place: str) -> bool:
    path, _, lines = place.rpartition(":")
    return judge.measured().covers(path, int(lines.partition("-")[0]))
