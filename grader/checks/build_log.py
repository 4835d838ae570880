"""Find the first error in the log of `colcon build`, and what to do about it."""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

from grader.course.packages import absent
from grader.words import mark, say

_MARKED = re.compile(r"\bError\b|\berror:|\bERROR\b|\bError\(s\)")
_OURS = re.compile(r"/ws/(?:src|build)/[^/\s']+/+|\bsubmission/(?=package\.xml)")
_PLACED = re.compile(r"CMake Error at (\S*) \(\w+\):\s*")
_CALLER = re.compile(r"^[ \t]*(CMakeLists\.txt:\d+ \(\w+\))[ \t]*$", re.MULTILINE)
_RAISED = re.compile(r"^\s*(?:[\w.]+\.)?([A-Z]\w*(?:Error|Exception|Specification|Package|Name|NotFound)): (.+)")
# setuptools runs the text of setup.py, so tracebacks know it as <string>.
_PLACE = re.compile(r'File "(?:/ws/src/[^/"]+/+([^/"][^"]*)|<string>)", line (\d+)')
_COMMANDS = {
    "rosidl_generate_interfaces": mark("find_package(rosidl_default_generators REQUIRED) before it"),
    "ament_package": mark("find_package(ament_cmake REQUIRED) before it"),
    "ament_get_python_install_dir": mark("find_package(ament_cmake REQUIRED) before it"),
    "ament_python_install_package": mark("find_package(ament_cmake_python REQUIRED) before it"),
    **dict.fromkeys(
        ["cmake_minimum_required", "project", "find_package", "install", "set", "if", "endif", "message"], ""
    ),
}
# What is known: by what the log says, what is said in its place ("": that itself), and what to do. {0} is a group.
_KNOWN = (
    (r'Function missing ending "\)"', "", mark("a parenthesis is opened there and never closed")),
    (r"the passed dependency '(\w+)' has not been found", "",
     mark("find_package({0} REQUIRED) before rosidl_generate_interfaces")),
    (r"the passed file '([^']+)' doesn't exist", "", mark("write {0}, or correct its name in CMakeLists.txt")),
    (r"rosidl_interface_packages", "",
     mark("add <member_of_group>rosidl_interface_packages</member_of_group> to package.xml, before <export>")),
    (r"Error processing '([^']*)' of '\w+/(\w+?)(?:_Request|_Response|_Goal|_Result|_Feedback)?'", "",
     mark("correct the line `{0}` of {1}: a type of ROS, a space, and a name in small letters")),
    (r"separators? '---'|'---' separators", "", mark("a .srv has one line ---, an .action two")),
    (r"add_custom_target cannot create target \"ament_cmake_python",
     mark("CMakeLists.txt: ament_python_install_package() and rosidl_generate_interfaces() both make the Python "
          "package"),
     mark("install(DIRECTORY ${PROJECT_NAME}/ DESTINATION ${PYTHON_INSTALL_DIR}/${PROJECT_NAME}) lays modules beside "
          "them")),
    (r'INSTALL cannot find "([^"]+)"', mark("CMakeLists.txt: install() names {0}, which is not there"),
     mark("write the file or folder, or take its name out of install()")),
    (r"Cannot find source file: (\S+)", "", mark("the nodes are in Python: take {0} and its commands out")),
    (r"'Project' is an invalid package name", "",
     mark("write project(NAME), with the name in package.xml, before find_package()")),
    (r"^'(\w+)'$",
     mark("CMakeLists.txt: rosidl_generate_interfaces() does not name {0}, whose types the interfaces use"),
     mark("DEPENDENCIES {0} as the last line of rosidl_generate_interfaces()")),
    (r"(?:mismatched tag|not well-formed|no element found|junk after document)[^:]{0,200}: line \d+, column \d+", "",
     mark("package.xml breaks off there: each <tag> needs its </tag>")),
    (r"The manifest must", "", mark("compare package.xml with the course's line by line")),
    (r"can't open file 'setup.py'", mark("there is no setup.py"), mark("write it, or a CMakeLists.txt")),
    (r"can't copy '([^']+)'", "", mark("write {0}, or take it out of data_files in setup.py")),
)  # fmt: skip


@dataclass(frozen=True)
class BuildError:
    """The first error of a build: what the log says, and what to do about it, "" if that is not known."""

    said: str
    cure: str = ""


def find_error(log: str) -> BuildError:
    """Return the first error in a build's log, with the lines that explain it; "" if no line is marked as an error."""
    said = _OURS.sub("", _first(log.splitlines()))
    if match := re.search(r'Unknown CMake command "(\w+)"', said):
        return BuildError(said, _cure_of_a_command(match[1]))
    if match := re.search(r'configuration file provided by "(\w+)"', said):
        text, cure = absent(match[1])
        where = re.match(r"CMake Error at (CMakeLists\.txt:\d+)", said)
        return BuildError(f"{where[1] if where else 'CMakeLists.txt'}: {text}", cure)
    for pattern, instead, cure in _KNOWN:
        if match := re.search(pattern, said):
            return BuildError(_filled(instead, match) or said[:500], _filled(cure, match))
    return BuildError(said[:500])


def _first(lines: Sequence[str]) -> str:
    first = next((number for number, line in enumerate(lines) if _MARKED.search(line)), None)
    raised = next((number for number, line in enumerate(lines) if line.startswith("Traceback (most recent")), None)
    if first is None or (raised is not None and raised < first and not _CALLER.search("\n".join(lines))):
        return _raised(lines[raised:]) if raised is not None else ""
    # CMake explains an error in the indented lines below it, colcon in the next one.
    explained = itertools.takewhile(lambda line: line.startswith("  ") or not line.strip(), lines[first + 1 :])
    below = [*explained] or (lines[first + 1 : first + 2] if lines[first].endswith(":") else [])
    words = [line.strip() for line in [lines[first], *below] if line.strip()]
    text, traceback, _ = " ".join(words).partition("Traceback (most recent call last)")
    if "Error processing" in text:  # rosidl's own error comes at the end of the command that failed
        return text[text.find("Error processing") :].strip()
    if traceback:
        exception = _raised(lines[first:])
        return f"{text.strip()} {exception}" if text.startswith("Error parsing") else exception
    caller = _CALLER.search("\n".join(lines[first : first + 60]))
    deep = _PLACED.match(text)
    if caller and deep and ("<ros>" in deep[1] or "cmake_install" in deep[1]):  # ROS's own file, not the student's
        return f"CMake Error at {caller[1]}: {text[deep.end() :]}"
    return text[max(0, text.find("Error(s) in package")) :]


def _raised(lines: Sequence[str]) -> str:
    """Return the words of the first exception whose traceback ends in these lines."""
    where = ""
    for number, line in enumerate(lines):
        if match := _PLACE.search(line):
            where = f"{match[1] or 'setup.py'}:{match[2]}: "
        if match := _RAISED.match(line):
            # CMake breaks long lines and indents them alike.
            more = itertools.takewhile(lambda line: line.startswith("  ") and line.strip(), lines[number + 1 :])
            return where + " ".join([match[2].strip(), *(line.strip() for line in more)])
    return ""


def _cure_of_a_command(name: str) -> str:
    if cure := _COMMANDS.get(name):
        return say(cure)
    near = difflib.get_close_matches(name, _COMMANDS, 1, 0.75)
    return say("is {command} meant?", command=near[0]) if near else say("find_package() of the package that has it")


def _filled(words: str, match: re.Match[str]) -> str:
    """Return words with the groups of the match; a brace of CMake's is none of these fields."""
    return re.sub(r"\{(\d)\}", lambda part: match[int(part[1]) + 1], say(words))
