"""Q2: docstrings, and ament_pep257's rules for them."""

from grader.checks.findings import MOST_SHOWN, listing
from grader.checks.judge import Judge
from grader.checks.package_text import label, public_definitions, unread_files, unread_lines, unread_share


def test_public_things_have_docstrings(judge: Judge) -> None:
    """Public modules, classes and functions have docstrings: full marks at 90 %, none at 0 %, linear between."""
    things = public_definitions(judge)
    unread = unread_files(judge)
    bare = [thing for thing in things if not thing.documented]
    share = 1 - len(bare) / len(things)
    if share < 0.9 or unread:
        names = [label(thing) for thing in bare[:MOST_SHOWN]]
        head = f"{len(things) - len(bare)} of {len(things)} have a docstring; it is missing at"
        said = [head, *names] if bare else []
        seen = "\n".join([*said, *unread_lines(unread)])
        share = min(share / 0.9, 1 - unread_share(judge, unread))
        judge.share(share, seen, "say in one sentence what a caller gets, with units and frames")


def test_docstrings_follow_ament_pep257(judge: Judge) -> None:
    """The docstrings of public modules, classes and functions follow ament_pep257's rules."""
    things = public_definitions(judge)
    documented = [thing for thing in things if thing.documented]
    clean = [thing for thing in documented if not thing.violations]
    # One good docstring does not earn the points of a package full of them.
    wanted = max(len(documented), 0.9 * len(things))
    unread = unread_files(judge)
    if len(clean) < wanted or unread:
        violations = [violation for thing in documented for violation in thing.violations]
        seen = f"{len(clean)} of {len(things)} have a docstring that follows every rule"
        seen = "\n".join([seen, *([listing(violations)] if violations else []), *unread_lines(unread)])
        share = min(len(clean) / wanted, 1 - unread_share(judge, unread))
        judge.share(share, seen, "run `ament_pep257` in the package's folder; it reports the same")
