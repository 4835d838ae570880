"""Facts about the package's text, which is read and never run."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Finding:
    """A place in the package's text where a rule applies. `path` is relative to the package."""

    path: str
    line: int
    rule: str
    text: str


@dataclass(frozen=True)
class SourceFile:
    """One Python file: its lines of code (neither blank nor comment), and why it could not be read, if so.

    `outside` of these lines are in no function. `functions` are the first and last lines of the functions that are
    inside no other one, decorators included.
    """

    path: str
    lines: int
    problem: str = ""
    outside: int = 0
    functions: list[list[int]] = field(default_factory=list)


@dataclass(frozen=True)
class Definition:
    """A public module, class or function, its missing annotations, and the rules that its docstring violates.

    `words` is how the docstring begins, in lower case and without signs and digits.
    """

    path: str
    line: int
    kind: str
    name: str
    documented: bool
    unannotated: list[str] = field(default_factory=list)
    violations: list[Finding] = field(default_factory=list)
    words: str = ""


@dataclass(frozen=True)
class Copy:
    """A block of `lines` lines of code that occurs in several places, each as "path:first-last"."""

    lines: int
    places: list[str]


@dataclass(frozen=True)
class FunctionUse:
    """The functions that the contract's module defines, where the nodes call them, and such work done elsewhere."""

    defined: list[str] = field(default_factory=list)
    calls: list[Finding] = field(default_factory=list)
    elsewhere: list[Finding] = field(default_factory=list)


@dataclass(frozen=True)
class ParameterUse:
    """Whether the code declares and reads a parameter of the contract."""

    node: str
    name: str
    declared: bool
    read: bool


@dataclass(frozen=True)
class CodeInterface:
    """An interface that the code creates under a literal name. `kind` is "publisher", "service" and so on."""

    node: str
    kind: str
    name: str
    type: str


@dataclass(frozen=True)
class Table:
    """A Markdown table: the cells of its head and of its rows."""

    head: list[str]
    rows: list[list[str]]


@dataclass(frozen=True)
class Readme:
    """The README: how many words of prose, the commands it shows for "build", "run" and "test", and its tables.

    `hidden` is how many words are in comments and elements that a reader of the page does not see; they do not count.
    """

    path: str
    words: int
    placeholders: list[Finding] = field(default_factory=list)
    shows: dict[str, str] = field(default_factory=dict)
    tables: list[Table] = field(default_factory=list)
    hidden: int = 0


@dataclass(frozen=True)
class TestReport:
    """test_results.xml: its cases as "module::name". `problem` says why it is not a junit report."""

    path: str
    problem: str = ""
    cases: list[str] = field(default_factory=list)
    failed: int = 0


@dataclass(frozen=True)
class Manifest:
    """package.xml, and what the package really is and uses.

    `placeholders` are the maintainers that no mail reaches.
    `declared_to_run` are the declared dependencies that are not for tests or documentation alone. `used` maps the name
    of a package to the places that use it.
    """

    found: bool
    problems: list[str] = field(default_factory=list)
    format: str = ""
    maintainers: list[str] = field(default_factory=list)
    placeholders: list[str] = field(default_factory=list)
    licences: list[str] = field(default_factory=list)
    spdx: list[bool] = field(default_factory=list)
    build_type: str = ""
    has_cmake: bool = False
    declared: list[str] = field(default_factory=list)
    declared_to_run: list[str] = field(default_factory=list)
    used: dict[str, list[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Fault:
    """Something in the package's text that will go wrong when it is built or run; `line` is 0 for a whole file.

    `stops` is what it keeps from working: "build", "install", "start", "parameters" or "interfaces". `cure`
    says what to do. `shown_as` are words that a build or a node prints because of it, and `lacks` the programs, files
    and interfaces ("srv/SetSpeed.srv") that are not there because of it.
    """

    path: str
    line: int
    stops: str
    text: str
    cure: str
    shown_as: list[str] = field(default_factory=list)
    lacks: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Quality:
    """Everything the package's text shows. `style` holds ament_flake8's findings, with suppressions ignored."""

    manifest: Manifest
    paths: list[str] = field(default_factory=list)
    files: list[SourceFile] = field(default_factory=list)
    style: list[Finding] = field(default_factory=list)
    definitions: list[Definition] = field(default_factory=list)
    complex: list[Finding] = field(default_factory=list)
    copies: list[Copy] = field(default_factory=list)
    habits: list[Finding] = field(default_factory=list)
    functions: FunctionUse = field(default_factory=FunctionUse)
    parameters: list[ParameterUse] = field(default_factory=list)
    interfaces: list[CodeInterface] = field(default_factory=list)
    readme: Readme | None = None
    report: TestReport | None = None
    tests: list[str] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    """The first cause of what stops the package comes first."""
