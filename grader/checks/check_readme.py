"""Q5: README.md, and its table of interfaces against the graph."""

from grader.checks.interface_table import agreement
from grader.checks.judge import Failed, Judge, NotReached
from grader.checks.package_text import weigh
from grader.evidence import Finding, Readme
from grader.words import MOST_SHOWN, mark, say

NEEDS = ("quality", "linters", "idle", "readme")

_WORDS = 10  # of prose, one sentence; fewer cannot say what a package does


def test_readme_says_what_and_how(judge: Judge) -> None:
    """README.md says what the package does, and how to build, run and test it."""
    weigh(judge)
    quality = judge.quality()
    readme = quality.readme
    if readme is None:
        others = [path for path in quality.paths if path.lower().startswith("readme")]
        found = say("; found {others}", others=", ".join(others)) if others else ""
        raise Failed(
            say("there is no README.md beside package.xml{found}", found=found), say("write README.md in the package")
        )
    missing = []
    if readme.words < _WORDS:
        said = mark("what it does ({readme.words} words of prose; at least {words} are needed)")
        missing.append(say(said, readme=readme, words=_WORDS))
    elif readme.placeholders:
        missing.append(say("what it does; there is a placeholder ({places})", places=_places(readme.placeholders)))
    commands = {
        "build": say("how to build it (colcon build)"),
        "run": say("how to run it (ros2 launch or ros2 run)"),
        "test": say("how to test it (pytest or colcon test)"),
    }
    missing += [words for what, words in commands.items() if what not in readme.shows]
    if missing:
        seen = "\n".join([say("not found:"), *missing, *_hidden(readme)])
        judge.share(
            1 - len(missing) / 4, seen, say("write for a reader who is new to the package, with commands to copy")
        )


def test_interface_table_agrees(judge: Judge) -> None:
    """README.md holds a table of the nodes' interfaces that agrees with the running nodes: names, types, directions."""
    weigh(judge)
    readme = judge.quality().readme
    if readme is None:
        raise NotReached(say("there is no README.md"))
    found = agreement(readme.tables, judge.evidence, judge.course.nodes.values())
    course = judge.course
    see = say("see {requirement}", requirement=course.requirement_of("check_graph") or say("the contract"))
    judge.expect(found.wanted > 0, say("neither the running nodes nor the code show an interface"), see)
    if found.wrong:
        source = say("the running nodes") if found.from_graph else say("the code")
        seen = "\n".join(
            [say("compared with {source}:", source=source), *found.wrong[: MOST_SHOWN * 2], *_hidden(readme)]
        )
        node = next(iter(course.nodes.values()))
        rows = [("subscribes", *row) for row in node.subscribes.items()]
        rows += [("service", *row) for row in node.services.items()]
        try_ = say("one row for each interface: | {cells} |", cells=" | ".join((node.name, *rows[0])))
        judge.share(1 - len(found.wrong) / found.wanted, seen, try_)


def _hidden(readme: Readme) -> list[str]:
    """Return a line about what a reader of the page does not see, if there is any."""
    words = mark("{n} words do not count: they are in comments, or in HTML that `hidden`, `style` or `class` may hide")
    return [say(words, n=readme.hidden)] if readme.hidden else []


def _places(found: list[Finding]) -> str:
    return ", ".join(say("line {finding.line}: {finding.text}", finding=finding) for finding in found[:3])
