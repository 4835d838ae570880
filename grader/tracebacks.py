"""Read in what Python prints where a program of the submission stopped. Text only; the program may have forged it."""

from __future__ import annotations

import re

# A frame of a traceback, and of a dump by faulthandler, which writes "line 7 in f" and no comma.
# That of a SyntaxError has no function.
_FRAME = re.compile(r'^[ \t]*File "([^"\n]+)", line (\d+)(?:,? in (\S+))?', re.MULTILINE)
_INSTALLED = re.compile(r"/install/(?:[^/]+/)?lib/(?:python[^/]+/site-packages/)?(.+)")
_NAMED = re.compile(r"(?<!\S)\S+\.py:\d+|\bline \d+")
# rosidl's generated C code, in which a value of a wrong type ends the process when the message is sent.
_ASSERTION = re.compile(r"\b(\w+)__convert_from_py: (Assertion `(?:Py(\w+)_Check\(field\)|[^`\n]*)' failed\.)")
_INTERFACE = re.compile(r"__(?:msg|srv|action)__")
_TYPES = {"Float": "float", "Long": "int", "Unicode": "str", "Bool": "bool"}
_NO_CALLBACK = "TypeError: 'NoneType' object is not callable"
_DUMP = "most recent call first"
_RAISED = re.compile(r"^Traceback \(most recent call last\):\n(?:[ \t].*\n)*+(\S.*)", re.MULTILINE)
# What `ros2 launch` writes before each line of a node's.
_PREFIX = re.compile(r"^\[[\w.-]+-\d+\] ", re.MULTILINE)
IN_THREAD = "Exception in thread "
"""What Python writes before the traceback of a thread that dies, while the others go on."""
BEGIN = "Traceback (most recent call last)"
"""How a traceback begins."""
# The second is rclpy's, of a callback that was under way when its node was destroyed.
_IGNORED = re.compile(
    r"^Exception ignored in:.*\n(?:Traceback \(most recent call last\):\n(?:[ \t].*\n)*(?:\S.*(?:\n|\Z)))?"
    r"|^The following exception was never retrieved: .*(?:\n|\Z)",
    re.MULTILINE,
)


def last_words(output: str) -> str:
    """Return the last line of an output and, after a traceback, the place in the package that it leads to.

    After a traceback, what garbage collection complains of does not count. Return "" if the output is empty.
    """
    if assertion := _ASSERTION.search(output):
        return _wrong_type(assertion, output)
    raised = without_ignored(output)
    output = raised if BEGIN in raised else output
    lines = [line for line in output.splitlines() if line.strip()]
    if not lines:
        return ""
    said = lines[-1].strip()[:300]
    if said == _NO_CALLBACK and "in await_or_execute" in output:  # the frames are the executor's and the spinning line
        return f"{said}: a callback is None; name it without brackets, `self.tick`, not `self.tick()`"
    place = _raised_at(output)
    return f"{said} ({place})" if place and not said.startswith("[") else said


def raised(output: str) -> tuple[str, str]:
    """Return what the last traceback in an output raised, and where in the package; "" for what is not known.

    The output may be that of `ros2 launch`.
    """
    *_, last = [None, *_RAISED.finditer(without_ignored(_PREFIX.sub("", output)))]
    return (last[1][:200], next(reversed(_places(last[0])), "")) if last is not None else ("", "")


def tail(output: str, most: int) -> str:
    """Return the end of an output, about `most` characters of it; its last traceback is there even if it is older."""
    found = output.rfind(BEGIN)
    if found < 0 or found >= len(output) - most:
        return output[-most:]
    end = _RAISED.search(output, found)
    whole = output[found : end.end() if end else found]
    if len(whole) > most:  # its end says what was raised
        whole = f"{BEGIN}:\n{whole[-most:].partition(chr(10))[2]}"
    return f"{whole}\n[...]\n{output[-most:]}"


def last_place(output: str) -> str:
    """Return the place to which the last words of an output lead, "" if they name none."""
    named = _NAMED.search(last_words(output))
    return (_raised_at(without_ignored(output)) or named[0]) if named else ""


def _raised_at(output: str) -> str:
    """Return the last place in the package to which the last traceback leads, "" if there is none."""
    return next(reversed(_places(output.rpartition(BEGIN)[2])), "") if BEGIN in output else ""


def _wrong_type(assertion: re.Match[str], output: str) -> str:
    """Return which message had a value of a wrong type, and where it was sent from."""
    kind = _TYPES.get(assertion[3] or "", "")
    name, _, part = _INTERFACE.split(assertion[1], maxsplit=1)[-1].partition("__")
    said = f"{assertion[2]} A value in {name}{f' ({part})' if part else ''} is not of the field's type"
    said += f", {kind}" if kind else ""
    if part == "response":
        return f"{said}; look at what the callback of this service puts into its response"
    place = hanging_place(output)
    return f"{said} ({place})" if place else said


def hanging_place(output: str) -> str:
    """Return the place in the package at which a dump of all threads shows it, "driver.py:88, in `f`"; "" if none."""
    _, found, dump = output.partition(_DUMP)
    return next(iter(_places(dump)), "") if found else ""


def dumped_files(output: str) -> list[str]:
    """Return for each thread that a dump shows inside of Python code the file in which it was."""
    frames = [_FRAME.search(dump) for dump in output.split(_DUMP)[1:]]
    return [frame[1] for frame in frames if frame]


def without_ignored(output: str) -> str:
    """Return an output without the exceptions that Python has ignored: garbage collection's, as the program ends."""
    return _IGNORED.sub("", output)


def ignored(output: str) -> str:
    """Return in one line the first exception that Python has ignored, "" if there is none."""
    match = _IGNORED.search(output)
    if match is None:
        return ""
    lines = [line.strip() for line in match[0].splitlines() if line.strip()]
    return f"{lines[0]} ... {lines[-1]}"[:300] if len(lines) > 1 else lines[0][:300]


def _places(text: str) -> list[str]:
    """Return the frames in files that the package has installed, in the text's order."""
    return [
        f"{own[1]}:{line}" + ("" if function in ("", "<module>") else f", in `{function}`")
        for path, line, function in _FRAME.findall(text)
        if (own := _INSTALLED.search(path))
    ]
