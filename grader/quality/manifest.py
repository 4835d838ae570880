"""Compare package.xml with what the package really has and uses."""

from __future__ import annotations

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath

from catkin_pkg.package import InvalidPackage, parse_package_string
from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from grader.course import definition
from grader.course.packages import ROS_1
from grader.evidence import Manifest
from grader.python_ast import argument, called, is_docstring, last_name, literal_string
from grader.quality.package_sources import PackageSources
from grader.quality.parsed_module import Module, absolute
from grader.sanitize import printable

_DEPENDS = (
    "depend", "build_depend", "build_export_depend", "buildtool_depend", "buildtool_export_depend", "exec_depend",
    "test_depend", "doc_depend",
)  # fmt: skip
# Calls in launch files that name a package: by the keyword `package`, or first.
_BY_KEYWORD = {"Node", "LifecycleNode", "ComposableNode", "ExecutableInPackage"}
_FIRST = {
    "FindPackageShare", "FindPackagePrefix", "get_package_share_directory", "get_package_share_path",
    "get_package_prefix",
}  # fmt: skip
# Domains without a dot or reserved by RFC 2606, where no mail arrives, and what templates have for the reader's name.
# At example.org and its like only those words: three of three authors without an address to give wrote one there.
_PLACEHOLDER = re.compile(
    r"[^@]+@(?:[\w-]+|(?:[\w-]+\.)*(?:todo|invalid|test|localhost|localdomain))|your[\w.+-]*@.+"
    r"|(?:you|me|name|user|root|todo|e?mail|maintainer|author|someone)@(?:mail\.|email\.)?example\.\w+",
    re.IGNORECASE,
)
_NO_NAME = re.compile(r"\s*(?:todo|your[ _-]?name)\s*(?:<|$)|.*>\s*(?:todo|your[ _-]?name)\s*$", re.IGNORECASE)
_ADDRESS = re.compile(r"(?<![\w.+-])[\w.+-]+@[\w.-]+")
_MAX_PLACES = 3
_MAX_NAMES = 200


def read_manifest(sources: PackageSources, modules: Sequence[Module]) -> Manifest:
    """Return what package.xml says, and what the package has and uses."""
    xml, found = sources.xml, "package.xml" in sources.paths
    problems, maintainers = _validity(sources) if not xml.problem else ([], [])
    licences = [printable(licence) for licence in xml.texts("license")]
    return Manifest(
        found=found,
        problems=[f"package.xml {xml.problem}"] if found and xml.problem else problems,
        format=xml.format,
        maintainers=maintainers,
        placeholders=[person for person in maintainers if _is_placeholder(person)],
        licences=licences,
        spdx=[_is_spdx(licence) for licence in licences],
        build_type=printable(xml.build_type),
        has_cmake=sources.has_cmake,
        declared=sorted({printable(name) for name in xml.texts(*_DEPENDS)})[:_MAX_NAMES],
        declared_to_run=sorted({printable(name) for name in xml.texts(*_DEPENDS[:-2])})[:_MAX_NAMES],
        used=dict(sorted(_uses(sources, modules).items())[:_MAX_NAMES]),
    )


def _validity(sources: PackageSources) -> tuple[list[str], list[str]]:
    """Return what ROS's own parser rejects in package.xml, and "name <address>" of each maintainer."""
    text = sources.read("package.xml")
    try:
        package = parse_package_string(text.encode(), filename="package.xml")
    except InvalidPackage as error:
        lines = [line.strip(" -\t") for line in str(error).splitlines() if line.strip()]
        # The first line may only say in which file.
        problems = [printable(re.sub(r"^Error\(s\) in package '.*?':?\s*", "", line)) for line in lines]
        problems = [problem for problem in problems if problem][-5:]
    except (ValueError, RecursionError, AssertionError, LookupError) as error:
        problems = [printable(f"package.xml cannot be read ({type(error).__name__})")]
    else:
        return [], [printable(f"{person.name} <{person.email}>") for person in package.maintainers[:5]]
    return problems, re.findall(r"<maintainer\b[^<>]*>[^<]*", text)[:5]


def _is_placeholder(person: str) -> bool:
    """Return whether no mail reaches a maintainer: no name, no address, or one that a template has filled in."""
    addresses = _ADDRESS.findall(person)
    return bool(_NO_NAME.match(person)) or all(_PLACEHOLDER.fullmatch(address) for address in addresses)


def _is_spdx(licence: str) -> bool:
    try:
        canonicalize_license_expression(licence)
    except (InvalidLicenseExpression, RecursionError):
        return False
    return True


def _uses(sources: PackageSources, modules: Sequence[Module]) -> dict[str, list[str]]:
    """Return the packages that code, launch files, CMake and interfaces use, each with places; not the package itself.

    That goes for a package under another name, too: package.xml cannot ask for itself.
    """
    found: dict[str, list[str]] = defaultdict(list)
    python = [PurePosixPath(path).with_suffix("") for path in sources.paths if path.endswith(".py")]
    itself = {sources.course.package, sources.xml.name}
    own = {*itself, *(path.parent.name if path.stem == "__init__" else path.stem for path in python)}
    own |= {folder for module in modules if module.role == "module" for folder in module.path.split("/")[:-1]}
    built = _build_words(sources, modules)
    used = [module for module in modules if _belongs(module, sources, itself, built)]
    for name, place in [*_in_python(used, own), *_in_cmake(sources), *_in_interfaces(sources)]:
        if name not in itself and place not in found[name] and len(found[name]) < _MAX_PLACES:
            found[name].append(place)
    return {name: places for name, places in found.items() if places}


def _build_words(sources: PackageSources, modules: Sequence[Module]) -> set[str]:
    """Return the words that CMakeLists.txt and setup.py use for what they build and install."""
    texts = [argument for command in sources.cmake for argument in command.arguments]
    for tree in (module.tree for module in modules if module.role == "setup"):
        texts += [literal_string(part) for node in tree.body if not is_docstring(node) for part in ast.walk(node)]
    return {word for text in texts for word in re.split(r"\W+", text)}


def _belongs(module: Module, sources: PackageSources, names: set[str], built: set[str]) -> bool:
    """Return whether a file is part of what package.xml speaks for. `built` are the words of the files that build it.

    A package inside the package has a package.xml of its own, and a script that nothing installs runs on no robot.
    """
    files = sources.paths
    parents = [parent.as_posix() for parent in PurePosixPath(module.path).parents][:-1]
    if any(f"{parent}/package.xml" in files for parent in parents):
        return False
    if module.path in sources.course.layout or module.role in ("launch", "test") or (parents and parents[-1] in names):
        return True
    if parents and f"{parents[0]}/__init__.py" in files:
        return True
    return (parents[-1] if parents else module.stem) in built


def _in_python(modules: Sequence[Module], own: set[str]) -> Iterator[tuple[str, str]]:
    known = sys.stdlib_module_names | own | set(ROS_1)  # no package.xml makes these available
    for module in modules:
        if module.role == "setup":
            continue
        for node in ast.walk(module.tree):
            if isinstance(node, ast.Call) and called(node) in _BY_KEYWORD | _FIRST:
                yield from ((name, f"{module.path}:{node.lineno}") for name in _named(node))
        for name, node in needed_imports(module):
            top = "" if isinstance(node, ast.ImportFrom) and node.level else name.partition(".")[0]
            if top and top not in known:
                yield top, f"{module.path}:{node.lineno}"


def _named(call: ast.Call) -> list[str]:
    """Return the package that a call in a launch file names: Node(package='x'), FindPackageShare('x')."""
    name = literal_string(argument(call, 99 if called(call) in _BY_KEYWORD else 0, "package", "package_name"))
    return [name] if re.fullmatch(r"[a-z][a-z0-9_]*", name) else []


def needed_imports(module: Module) -> Iterator[tuple[str, ast.Import | ast.ImportFrom]]:
    """Yield the dotted modules that a module imports, with the statements; not those in a `try` for ImportError."""
    optional = set()
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Try):
            caught = {last_name(part) for handler in node.handlers if handler.type for part in ast.walk(handler.type)}
            if caught & {"ImportError", "ModuleNotFoundError"}:
                # The alternative in the handler is as optional as the import that it replaces.
                optional |= {id(part) for statement in [*node.body, *node.handlers] for part in ast.walk(statement)}
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import) and id(node) not in optional:
            yield from ((alias.name, node) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and id(node) not in optional:
            yield absolute(module, node), node


def _in_cmake(sources: PackageSources) -> Iterator[tuple[str, str]]:
    for command in sources.commands("find_package"):
        name = command.arguments[0] if command.arguments else ""
        if re.fullmatch(r"[a-z][a-z0-9_]*", name):
            yield name, f"CMakeLists.txt:{command.line}"


def _in_interfaces(sources: PackageSources) -> Iterator[tuple[str, str]]:
    """Yield the packages of the field types. A package of interfaces declares its own dependencies."""
    for path in sources.interfaces:
        yield from ((name, f"{path}:{line}") for line, name in definition.packages(sources.read(path)))
    if sources.interfaces and sources.has_cmake:
        yield "rosidl_default_runtime", "the generated interfaces"
