"""Put findings into words that teach: what stands where, which rule it breaks, and why that rule is worth keeping."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from grader.evidence import Finding

MOST_SHOWN = 10
_PLACES = 3

# A sentence for the rules that students meet most; a longer name goes before its beginning.
WHY = {
    "E1": "indentation is what Python's structure is made of, so it should be the same everywhere",
    "E2": "even spaces let the eye find operators and arguments",
    "E3": "blank lines are the paragraphs of code: two between definitions, one inside a class",
    "E4": "imports at the top show at a glance what a module depends on",
    "E5": "a line over 99 columns is cut off where two versions stand side by side",
    "E7": "one statement a line lets a debugger stop at each, and a diff show each",
    "E711": "`is None` asks for None itself; `==` may be answered by any class",
    "E722": "a bare `except` also catches Ctrl-C and your own typing errors",
    "E731": "a `def` has a name in a traceback, a lambda has none",
    "E741": "l, O and I look like 1 and 0",
    "E9": "Python cannot read this file",
    "W1": "tabs and spaces mixed look right in one editor and wrong in the next",
    "W2": "spaces at the end of a line are invisible, and show up in every diff",
    "W29": "spaces at the end of a line are invisible, and show up in every diff",
    "W3": "an end of file without a line break, or with many, shows up in diffs",
    "W6": "Python is about to give this another meaning",
    "F4": "an import that nobody uses makes readers look for its use",
    "F5": "the text and what is put into it do not match",
    "F8": "a name that is not defined fails only when the line runs: perhaps before the wall",
    "F811": "what is bound twice is used once: one of the two is left over, or was meant to be called otherwise",
    "F841": "a value that nobody uses is either left over or a forgotten step",
    "C9": "each branch doubles the ways through a function; what has more than ten cannot be tested in full",
    "D2": "docstrings of one shape can be read by people and by tools",
    "D3": "three double quotes are what every tool looks for",
    "D4": "the first line of a docstring is a sentence that stands alone in an index",
    "D401": "say what it does as an order: Return, Publish, Stop",
    "bare-except": "a bare `except` also catches Ctrl-C and your own typing errors; name what you expect",
    "print": "the node's logger says who spoke, when and how serious it is, and reaches /rosout",
    "mutable-default": "a default is made once, so all calls share it, and what one leaves in it the next one finds",
    "sleep-in-callback": "while a callback sleeps, its thread hears no scan: the robot drives on blindly",
}


def why(rule: str) -> str:
    """Return the sentence for a rule, "" if there is none."""
    return next((WHY[rule[:end]] for end in range(len(rule), 0, -1) if rule[:end] in WHY), "")


def listing(findings: Sequence[Finding]) -> str:
    """Return the findings as lines: each rule with its reason, the most frequent first, and some of its places."""
    counts = Counter(finding.rule for finding in findings)
    lines: list[str] = []
    shown = 0
    for rule, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])):
        if shown >= MOST_SHOWN:
            break
        some = [finding for finding in findings if finding.rule == rule][: min(_PLACES, MOST_SHOWN - shown)]
        shown += len(some)
        reason = f": {why(rule)}" if why(rule) else ""
        lines.append(f"{rule}{f' ({count} times)' if count > 1 else ''}{reason}")
        lines += [f"  {place(finding)} {finding.text}" for finding in some]
    if len(findings) > shown:
        lines.append(f"and {len(findings) - shown} more")
    return "\n".join(lines)


def place(finding: Finding) -> str:
    """Return "path:line"."""
    return f"{finding.path}:{finding.line}"


def some(words: Sequence[str], most: int = MOST_SHOWN) -> str:
    """Return words joined by commas, the rest as a number."""
    rest = f" and {len(words) - most} more" if len(words) > most else ""
    return ", ".join(words[:most]) + rest
