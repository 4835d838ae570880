"""Decide whether a CMakeLists.txt runs no code of its package. An allow-list: what it does not know counts as code."""

from __future__ import annotations

import re

_COMMANDS = {
    "cmake_minimum_required", "project", "find_package", "rosidl_generate_interfaces", "ament_get_python_install_dir",
    "install", "ament_package", "ament_export_dependencies", "if", "elseif", "else", "endif", "set", "message",
    "ament_lint_auto_find_test_dependencies", "ament_add_pytest_test", "add_compile_options",
}  # fmt: skip
_HARMLESS_VARIABLE = re.compile(r"\bCMAKE_(CXX_STANDARD|C_STANDARD|COMPILER_IS_GNUCXX|CXX_COMPILER_ID)\b")
_LOADS_CODE = re.compile(
    r"\bCMAKE_(?!CURRENT)|RULE_LAUNCH|CONFIG_EXTRAS|\b(CODE|SCRIPT|ENV|PATHS|HINTS)\b", re.IGNORECASE
)
_LIST_VARIABLE = re.compile(
    r"(?!ament|rosidl|python|_)(\w+_)?(msg|srv|action|interface|file|dep|dependencie|script|source|node|executable)s?",
    re.IGNORECASE,
)
_WARNING_OPTION = re.compile(r"-W[a-z][a-z-]*")


def only_declares(cmake: str) -> bool:
    """Return whether the text of a CMakeLists.txt has only commands that run no code of the package."""
    # Whole-line comments do not count, except where a string or a bracket argument could end in one.
    lines = [line for line in cmake.splitlines() if not line.lstrip().startswith("#") or set(line) & set('"]')]
    code = _HARMLESS_VARIABLE.sub("files", "\n".join(lines))
    commands = {name.lower() for name in re.findall(r"\b(\w+)\s*\(", code)}
    if not commands <= _COMMANDS or _LOADS_CODE.search(code.replace("cmake_minimum_required", "")):
        return False
    # CMake and rosidl keep the programs that they run in variables, and a name can be put together from others.
    variables = re.findall(r"\bset\s*\(\s*([^\s)]*)", code, re.IGNORECASE)
    options = re.findall(r"\badd_compile_options\s*\(([^)]*)", code, re.IGNORECASE)
    return all(_LIST_VARIABLE.fullmatch(name) for name in variables) and all(
        _WARNING_OPTION.fullmatch(option) for found in options for option in found.split()
    )
