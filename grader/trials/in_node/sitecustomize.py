"""Note which of a package's functions run in this process, and code that runs and lies in no file that can be read.

Python imports it by its name at its start; it is mounted alone into the sandboxes of trials, and imports nothing of the
grader. What it writes is no more than a hint of what ran: the submission can write there, too, and gains nothing by it
that calling a function would not give.

A line is its kind and the parts of it, between tabs: "start"; "import" and a file; "call", a file and the first line of
a function; "unseen", what kind of code, what it is, and the place that made it run. See sys.addaudithook (PEP 578).
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from types import CodeType, FrameType

_FOLDER = "/ws/ran"
_PIPE = _FOLDER + "/pipe"
_ALL_FUNCTIONS = _FOLDER + "/functions"  # it is there if functions are to be noted
_OWN = ("/ws/install/", "/ws/src/")
_OF_THE_GRADER = ("/ws/ros2/", "/ws/at_start/", "/ws/first/", "/ws/launch/", "<frozen ")
_LONGEST = 2000  # bytes of a line; what is written at once below 4096 bytes is not mixed with another's
_MOST_UNSEEN = 50
_SHORT_COMMAND = 200  # `python -c` with no more characters can only start what is seen by itself

_MADE, _BYTE_CODE, _ARCHIVE = "code made at run time", "byte code", "archive"
_LIBRARY, _TURNED_OFF = "library", "notes turned off"
# Libraries that make code of names, and call nothing that they are given. Of the others here, expressions are short.
_GENERATORS = (
    "/dataclasses.py", "/collections/__init__.py", "/numpy/core/", "/numpy/_core/", "/numpy/ma/", "/rosbags/",
    "/_pytest/assertion/rewrite.py",
)  # fmt: skip
_GENERATED = "<attrs generated"
_EVALUATORS = (
    "/typing.py", "/typing_extensions.py", "/inspect.py", "/logging/config.py",
    "/em.py",  # of empy, which rclpy imports with a node's first service
)  # fmt: skip
_LONGEST_EXPRESSION = 200  # bytes of byte code
_FUNCTION = 0x1  # CO_OPTIMIZED: the code of a function, not of a module or of a class
_UNNAMED = ("<listcomp>", "<setcomp>", "<dictcomp>", "<genexpr>")
_C_API = ("PyRun_", "PyEval_", "Py_CompileString", "Py_RunMain", "Py_BytesMain")
_INTERPRETERS = ("_xxsubinterpreters", "_interpreters", "_testcapi", "_testinternalcapi")
_WATCHED = frozenset({
    "exec", "function.__new__", "object.__setattr__", "ctypes.dlopen", "ctypes.dlsym", "import", "cpython.run_file",
    "cpython.run_command", "cpython.run_stdin", "subprocess.Popen", "os.exec", "os.posix_spawn", "os.spawn",
    "os.system",
})  # fmt: skip
_TURNS_OFF = frozenset({"sys.settrace", "sys.setprofile", "sys.monitoring.register_callback", "sys.addaudithook"})
_FINDS_US = frozenset({"gc.get_objects", "gc.get_referrers", "gc.get_referents"})
_ENCODINGS = (b"utf-8", b"utf8", b"ascii", b"latin-1", b"iso-8859-1", b"iso-8859-15", b"cp1252")


def _install() -> None:  # all in closures, so that no module holds what a package could replace
    import importlib.machinery as machinery
    import opcode
    import re
    import warnings

    encoding = re.compile(rb"^[ \t\f]*#.*?coding[:=][ \t]*([-\w.]+)", re.MULTILINE).search
    calls = {number for name, number in opcode.opmap.items() if name.startswith("CALL")}
    getframe, write, compile_, open_ = sys._getframe, os.write, compile, open
    os_open, close, flags = os.open, os.close, os.O_WRONLY | os.O_NONBLOCK | os.O_CLOEXEC
    splitext, isfile = os.path.splitext, os.path.isfile
    loader_type, sourceless = machinery.SourceFileLoader, machinery.SourcelessFileLoader
    loading = tuple(getattr(loader_type, name) for name in ("get_code", "get_data", "source_to_code", "exec_module"))
    elsewhere = [path for path in os.environ.get("PYTHONPATH", "").split(":") if path and not path.startswith("/ws/")]
    places = (sys.prefix, sys.base_prefix, os.__file__.rpartition("/")[0], *elsewhere)
    libraries = (*_OF_THE_GRADER, *(f"{place}/" for place in places))
    library_folders = os.environ.get("LD_LIBRARY_PATH", "").split(":")
    known_files: dict[str, bool] = {}
    texts: dict[str, set[CodeType]] = {}
    unseen: set[tuple[str, str, str]] = set()
    imported: set[str] = set()
    notes_functions = isfile(_ALL_FUNCTIONS)
    at_start = __file__.rpartition("/")[0]
    command_is_known = False

    def note(*words: str) -> None:
        line = "\t".join(word.replace("\t", " ").replace("\n", " ") for word in words)
        try:
            pipe = os_open(_PIPE, flags)
        except OSError:
            return
        try:
            write(pipe, line.encode("utf-8", "replace")[:_LONGEST] + b"\n")
        except OSError:
            pass
        finally:
            close(pipe)

    def is_library(file: str) -> bool:
        found = known_files.get(file)
        if found is None:
            found = known_files[file] = file.startswith(libraries) and "/../" not in file
        return found

    def is_in_text(code: CodeType) -> bool:
        """Return whether code is what Python makes of the text in its file."""
        file = code.co_filename
        if file not in texts:
            found = texts[file] = set()
            try:
                with open_(file, "rb") as stream, warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    text = stream.read()
                    cookie = encoding(b"\n".join(text.split(b"\n", 2)[:2]))
                    if cookie and cookie[1].lower().replace(b"_", b"-") not in _ENCODINGS:
                        return False  # the package may have brought the codec, and so what the text means
                    todo = [compile_(text, file, "exec", dont_inherit=True)]
            except (OSError, SyntaxError, ValueError):
                return False
            while todo:
                part = todo.pop()
                found.add(part)
                todo += [constant for constant in part.co_consts if type(constant) is type(part)]
        return code in texts[file]

    def is_read(code: CodeType) -> bool:
        file = code.co_filename
        return (file.startswith(_OWN) or is_library(file)) and is_in_text(code)

    def place(frame: FrameType | None) -> str:
        """Return the nearest line of the package's own, "" if there is none."""
        while frame is not None:
            file = frame.f_code.co_filename
            if file[:1] == "/" and not is_library(file):
                return f"{file}:{frame.f_lineno}"
            frame = frame.f_back
        return ""

    def report(kind: str, what: str, frame: FrameType | None) -> None:
        line = (kind, what[:300], place(frame))
        if line not in unseen and len(unseen) < _MOST_UNSEEN:
            unseen.add(line)
            note("unseen", *line)

    def note_import(file: str) -> None:
        if file not in imported:
            imported.add(file)
            note("import", file)

    def report_file(code: CodeType, frame: FrameType, loader: object = None) -> None:
        """Report code that is not what its file's text says: an archive's, if that is above the file's path."""
        file = archive = code.co_filename
        while "/" in archive and not isfile(archive):
            archive = archive.rpartition("/")[0]
        if type(loader) is sourceless or splitext(file)[1] in (".pyc", ".pyo"):
            report(_BYTE_CODE, file, frame)
        elif archive and archive != file:
            report(_ARCHIVE, archive, frame)
        else:
            report(_MADE, file, frame)

    def run_by_import(code: CodeType, frame: FrameType) -> None:
        caller = frame.f_back
        loader = caller.f_locals.get("self") if caller is not None else None
        plain = loader is None or type(loader) is loader_type
        now = (loader_type.get_code, loader_type.get_data, loader_type.source_to_code, loader_type.exec_module)
        file = code.co_filename
        # To read each module once more takes 50 ms a node, so it is done only where it is noted.
        known = is_library(file) or (not notes_functions and file.startswith(_OWN) and isfile(file))
        if plain and now == loading and sys.pycache_prefix is None and known:
            return
        if is_read(code):
            note_import(file)
        else:
            report_file(code, frame, loader)

    def run_without_frame(code: CodeType) -> None:
        """Look at what Python itself starts, and at what other code than Python's starts by its C API."""
        nonlocal command_is_known
        if code.co_filename == "<string>" and command_is_known:
            command_is_known = False
        elif not is_read(code):
            report(_MADE, "a string" if code.co_filename.startswith("<") else code.co_filename, None)

    def run_by_exec(code: CodeType, frame: FrameType) -> None:
        caller, file = frame.f_code.co_filename, code.co_filename
        if caller.startswith(("<frozen importlib", "<frozen zipimport")):
            run_by_import(code, frame)
        elif caller.startswith(("<frozen runpy", "/ws/ros2/", "/ws/first/")):
            if is_read(code):
                note_import(file)
            elif not (is_library(file) and isfile(file)):
                report_file(code, frame)
        elif not (is_library(caller) and is_generated(code, caller)):
            report(_MADE, "a string" if file.startswith("<") else file, frame)

    def is_generated(code: CodeType, caller: str) -> bool:
        """Return whether a library makes code of its own, or evaluates an expression in which nothing is defined."""
        if any(part in caller for part in _GENERATORS) or code.co_filename.startswith(_GENERATED):
            return True
        inside = any(type(constant) is type(code) for constant in code.co_consts)
        calls_nothing = calls.isdisjoint(code.co_code[::2])
        return (
            caller.endswith(_EVALUATORS) and len(code.co_code) <= _LONGEST_EXPRESSION and not inside and calls_nothing
        )

    def made_by_type(code: CodeType, frame: FrameType | None) -> None:
        caller = frame.f_code.co_filename if frame is not None else ""
        generated = is_library(code.co_filename) or any(part in caller for part in _GENERATORS)
        if not (is_library(caller) and generated) and not is_read(code):
            report(_MADE, code.co_filename, frame)

    def is_brought(path: str) -> bool:
        if "/" in path:
            return not is_library(path) and not path.startswith(
                ("/usr/", "/lib/", "/lib64/", "/bin/", "/sbin/", "/opt/")
            )
        return any(folder.startswith("/ws/") and isfile(f"{folder}/{path}") for folder in library_folders)

    def is_of_types(path: str) -> bool:
        return path.startswith(_OWN) and "__rosidl_" in path.rpartition("/")[2]

    def started(command: list[str], environment: Any, frame: FrameType | None) -> None:
        """Look at another program: one that was brought along and is no text, or a Python that notes nothing."""
        if not command:
            return
        names = [word.rpartition("/")[2] for word in command]
        at = next((number for number, name in enumerate(names) if name.startswith("python")), -1)
        known = dict(os.environ if environment is None else environment)
        if at >= 0:
            options = [word for word in command[at + 1 : at + 4] if word.startswith("-") and not word.startswith("--")]
            emptied = any(word in ("-i", "-", "unset") or word.startswith("PYTHONPATH=") for word in command[:at])
            if emptied or any(set(word) & set("IES") for word in options):
                report(_TURNED_OFF, " ".join(command[: at + 3]), frame)
            elif at_start not in os.fsdecode(known.get("PYTHONPATH") or known.get(b"PYTHONPATH") or ""):
                report(_TURNED_OFF, "a Python without PYTHONPATH", frame)
        elif command[0].startswith("/") and is_brought(command[0]) and isfile(command[0]):
            with open_(command[0], "rb") as stream:
                if stream.read(2) != b"#!":
                    report(_LIBRARY, command[0], frame)

    def words(text: object) -> list[str]:
        if isinstance(text, str | bytes):
            return os.fsdecode(text).split()
        return [os.fsdecode(word) for word in text] if isinstance(text, list | tuple) else []

    def look(event: str, args: tuple[Any, ...], frame: FrameType | None) -> None:
        nonlocal command_is_known
        if event == "cpython.run_file":
            note_import(os.fsdecode(args[0]))
        elif event == "cpython.run_command":
            command_is_known = True
            if len(str(args[0])) > _SHORT_COMMAND:
                report(_MADE, "python -c", frame)
        elif event == "cpython.run_stdin":
            report(_MADE, "standard input", frame)
        elif event == "exec" and frame is None:
            run_without_frame(args[0])
        else:
            look_at_call(event, args, frame)

    def look_at_call(event: str, args: tuple[Any, ...], frame: FrameType | None) -> None:
        if event == "exec" and frame is not None:
            run_by_exec(args[0], frame)
        elif event == "function.__new__":
            made_by_type(args[0], frame)
        elif event == "object.__setattr__":
            if args[1] == "__code__":
                made_by_type(args[2], frame)
        elif event == "ctypes.dlopen":
            if args[0] and is_brought(os.fsdecode(args[0])) and not is_of_types(os.fsdecode(args[0])):
                report(_LIBRARY, os.fsdecode(args[0]), frame)
        elif event == "ctypes.dlsym":
            if str(args[1]).startswith(_C_API):
                report(_MADE, str(args[1]), frame)
        elif event == "import":
            if args[0].rpartition(".")[2] in _INTERPRETERS and not is_library(place(frame).rpartition(":")[0]):
                report(_MADE, args[0], frame)
            elif args[1] and is_brought(str(args[1])) and not is_of_types(str(args[1])):
                report(_LIBRARY, str(args[1]), frame)
        elif event == "os.system":
            started(words(args[0]), None, frame)
        else:
            program, command = args[:2] if event != "os.spawn" else args[1:3]
            command = words(command)
            shell = event == "subprocess.Popen" and command[:2] == ["/bin/sh", "-c"]
            started(words(command[2]) if shell else [os.fsdecode(program), *command[1:]], args[-1], frame)

    def turned_off(event: str, frame: FrameType | None) -> None:
        file = frame.f_code.co_filename if frame is not None else ""
        if file != __file__ and not (file.endswith("/threading.py") and is_library(file)):
            report(_TURNED_OFF, event, frame)

    def hook(event: str, args: tuple[Any, ...]) -> None:
        if event not in watched:
            return
        try:
            try:
                frame = getframe(1)
            except ValueError:  # Python's own start
                frame = None
            if event in _TURNS_OFF:
                turned_off(event, frame)
            elif event in _FINDS_US:
                if frame is not None and not is_library(frame.f_code.co_filename):
                    report(_TURNED_OFF, event, frame)
            else:
                look(event, args, frame)
        except Exception:  # whatever happens here must not happen to the package
            return

    def is_function(code: CodeType) -> bool:
        return bool(code.co_flags & _FUNCTION) and code.co_name not in _UNNAMED

    seen: dict[int, CodeType] = {}

    def first_call(code: CodeType) -> None:
        seen[id(code)] = code  # which keeps it, so that its number stays its own
        if threads is not None and (code in threads_settrace or threads._trace_hook is not trace):
            report(_TURNED_OFF, "threading.settrace", getframe(2))
        if is_function(code) and not is_library(code.co_filename):
            note("call", code.co_filename, str(code.co_firstlineno))

    def trace(frame: FrameType, _event: str, _arg: object) -> None:
        code = frame.f_code
        if id(code) not in seen:
            first_call(code)

    threads: Any = None
    threads_settrace: tuple[CodeType, ...] = ()
    watched = _WATCHED | _FINDS_US
    note("start")
    if notes_functions and hasattr(sys, "monitoring"):
        monitoring: Any = sys.monitoring  # type: ignore[attr-defined, unused-ignore]  # from 3.12 on

        def begins(code: CodeType, _offset: int) -> object:
            first_call(code)
            return disable

        disable, tool = monitoring.DISABLE, monitoring.PROFILER_ID
        monitoring.use_tool_id(tool, "notes")
        monitoring.register_callback(tool, monitoring.events.PY_START, begins)
        monitoring.set_events(tool, monitoring.events.PY_START)
        watched |= {"sys.monitoring.register_callback", "sys.addaudithook"}
    elif notes_functions:
        import threading

        threads = threading
        threads_settrace = (threading.settrace.__code__,)
        threading.settrace(trace)
        sys.settrace(trace)
        watched |= _TURNS_OFF
    sys.addaudithook(hook)


if os.access(_PIPE, os.W_OK):
    _install()
del _install
