"""What a node's process notes of what runs in it, and what the grader makes of such notes."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from contextlib import closing
from pathlib import Path

import pytest
from helpers import beside

from grader.evidence import Ran, Trial
from grader.host import ros_env
from grader.quality.source_files import PythonFile
from grader.trials import what_ran
from grader.trials.source import integrity_flags
from grader.trials.what_ran import Notes

TEXTS = beside(__file__)

HOOK = (Path(what_ran.__file__).with_name("in_node") / "sitecustomize.py").read_text()
SITE = str(ros_env.SITE_IN_PREFIX)


@pytest.fixture
def run(tmp_path: Path):
    """Run a program of a package, with modules beside it, as a trial runs a node; return what it has noted."""
    (tmp_path / "ws/install/share").mkdir(parents=True)
    (tmp_path / "ws/at_start").mkdir()
    hook = HOOK.replace('"/ws/', f'"{tmp_path}/ws/')
    (tmp_path / "ws/at_start/sitecustomize.py").write_text(hook)

    def started(program: str, functions: bool = True, **modules: str) -> Ran | None:
        with closing(Notes(tmp_path)) as notes:
            notes.begin(functions=functions)
            folder = next(host for host, inside in notes.mounts.items() if inside == "/ws/ran")
            (tmp_path / "ws/ran").unlink(missing_ok=True)
            (tmp_path / "ws/ran").symlink_to(folder)
            for name, text in {"node": program, **modules}.items():
                (tmp_path / f"ws/install/{name}.py").write_text(textwrap.dedent(text))
            environment = {"PYTHONPATH": f"{tmp_path}/ws/at_start", "PATH": os.environ["PATH"]}
            environment |= {"WS": f"{tmp_path}/ws", "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
            environment |= {"LD_LIBRARY_PATH": ros_env.library_path()}
            done = subprocess.run(
                [sys.executable, f"{tmp_path}/ws/install/node.py"],
                env=environment, capture_output=True, text=True, check=False, cwd=tmp_path,
            )  # fmt: skip
            assert done.returncode == 0, done.stderr
            text = os.read(notes._read_end, 1 << 20).decode()
            writer = os.open(folder / "pipe", os.O_WRONLY | os.O_NONBLOCK)
            os.write(writer, text.replace(f"{tmp_path}/ws/", "/ws/").encode())
            os.close(writer)
            return notes.read(node_is_up=True)

    return started


def kinds(ran: Ran | None) -> set[str]:
    return {words.partition(":")[0] for words in ran.unseen} if ran is not None else set()


def test_functions_that_ran_are_noted_with_their_files(run):
    ran = run(
        "import helper, constants\nhelper.used()\n",
        helper="def used():\n    return [n for n in (1, 2)]\n\n\ndef idle():\n    return 2\n",
        constants="SIDES = [2 * n for n in range(3)]\n\n\ndef idle():\n    return 1\n",
    )
    assert ran == Ran({"constants.py": [], "helper.py": [1], "node.py": []})


def test_functions_of_a_thread_are_noted(run):
    ran = run("import threading\ndef work():\n    pass\nt = threading.Thread(target=work)\nt.start()\nt.join()\n")
    assert ran == Ran({"node.py": [2]})


def test_other_trials_note_nothing_but_what_cannot_be_read(run):
    assert run("def f():\n    pass\nf()\n", functions=False) is None
    assert kinds(run("exec('x = 1')\n", functions=False)) == {"code made at run time"}


TIDY = "def tidy():\n    return 1\n"


@pytest.mark.parametrize("program", TEXTS["UNSEEN"].values(), ids=TEXTS["UNSEEN"])
def test_code_that_lies_in_no_file_is_noted(run, program: str):
    ran = run(program, functions=False, tidy=TIDY)
    assert kinds(ran) == {"code made at run time"}
    beside = ("a string", "python -c", "standard input", "x.py")  # of a thread, and of a Python, who began is not known
    assert ", by node.py:" in ran.unseen[0] or ran.unseen[0].endswith(beside)


def test_a_module_in_an_encoding_of_the_packages_own_is_noted(run):
    program = (
        "import codecs, os\nu = codecs.lookup('utf-8')\n"
        "own = codecs.CodecInfo(u.encode, u.decode, incrementaldecoder=u.incrementaldecoder, streamreader=u.streamreader)\n"
        "codecs.register(lambda name: own if name == 'own' else None)\n"
        "open(os.environ['WS'] + '/install/odd.py', 'wb').write(b'# coding: own\\nx = 1\\n')\nimport odd"
    )
    assert kinds(run(program)) == {"code made at run time"}


@pytest.mark.parametrize(("kind", "program"), TEXTS["OTHER_KINDS"].items(), ids=TEXTS["OTHER_KINDS"])
def test_other_forms_of_code_have_kinds_of_their_own(run, kind: str, program: str):
    assert kinds(run(program, functions=False)) == {kind}


@pytest.mark.parametrize("program", TEXTS["TURNED_OFF"].values(), ids=TEXTS["TURNED_OFF"])
def test_turning_the_notes_off_is_noted(run, program: str):
    assert kinds(run(program)) == {"notes turned off"}


@pytest.mark.parametrize("program", TEXTS["HONEST"].values(), ids=TEXTS["HONEST"])
def test_what_honest_code_does_is_not_noted(run, program: str):
    ran = run(program, tidy=TIDY, old="# -*- coding: latin-1 -*-\n" + TIDY)
    assert ran is not None
    assert ran.unseen == []


def test_what_yaml_runs_is_noted(run):
    """The nodes' code was text in a parameter file, behind tidy modules that never ran."""
    text = "!!python/object/apply:builtins.exec ['x = 1']"
    ran = run(f"import yaml\nyaml.unsafe_load({text!r})\n", tidy=TIDY)
    assert kinds(ran) == {"code made at run time"}
    assert "tidy.py" not in ran.functions


# -- what is seen from outside ------------------------------------------------------------------------------------------

SHOWN = {
    "a library loaded by cffi": ("lib/p/table.bin", "", "library: lib/p/table.bin"),
    "a library beside those of the types": (f"{SITE}/p/x__rosidl_core.so", "", f"library: {SITE}/p/x__rosidl_core.so"),
    "a library that is gone": ("/tmp/x.so (deleted)", "", "library: /tmp/x.so"),
    "a library in memory": ("/memfd:x (deleted)", "", "library: /memfd:x"),
    "a program with a Python of its own": ("lib/p/node", "", "library: lib/p/node"),
    "an isolated Python": ("", "python3 -I -S x.dat", "notes turned off: python3 -I -S x.dat"),
    "options in one": ("", "/usr/bin/python3 -bES x.dat", "notes turned off: /usr/bin/python3 -bES x.dat"),
    "a Python by another name": ("", "node -I x.dat", "notes turned off: node -I x.dat"),
    "a Python without the variable": ("", "PATH=/bin python3 x", "notes turned off: a Python without PYTHONPATH"),
    "a Python": ("", "python3 -m pip -I", None),
    "a script": ("", "python3 /ws/install/lib/p/node -S", None),
    "a short command": ("", "python3 -c S=1", None),
    "the types' module": (f"{SITE}/p/p_s__rosidl_typesupport_fastrtps_c.cpython-311-x86_64-linux-gnu.so", "", None),
    "the types' library": ("lib/libp__rosidl_typesupport_introspection_c.so", "", None),
    "closures of libffi": ("/memfd:libffi (deleted)", "", None),
    "the system's libraries": ("/usr/lib/x86_64-linux-gnu/libm.so.6", "", None),
}


@pytest.mark.parametrize(("mapped", "command", "words"), SHOWN.values(), ids=SHOWN)
def test_what_python_does_not_note_is_seen_in_proc(tmp_path: Path, mapped: str, command: str, words: str | None):
    environment = [] if command.startswith("PATH=") else ["PYTHONPATH=/ws/at_start:/usr/lib"]
    files = {"/usr/bin/python3.11": "r-xp", "/ws/install/share/p/table.dat": "r--p"}
    files |= {mapped if mapped.startswith("/") else f"/ws/install/{mapped}": "r-xp"} if mapped else {}
    lines = [f"7f00-7f01 {rights} 00000000 08:01 {n}    {file}\n" for n, (file, rights) in enumerate(files.items())]
    (tmp_path / "maps").write_text("".join([*lines, "7f02-7f03 r-xp 00000000 00:00 0\n"]))
    shown = [word for word in command.split() if "PATH=" not in word] or ["python3", "/ws/install/lib/p/node"]
    for name, parts in (("cmdline", shown), ("environ", environment)):
        (tmp_path / name).write_bytes(b"".join(os.fsencode(part) + b"\0" for part in parts))
    assert what_ran.unseen_of_process(tmp_path) == ([words] if words else [])


def test_a_process_that_has_ended_shows_nothing(tmp_path: Path):
    assert what_ran.unseen_of_process(tmp_path / "1") == []


# -- what the grader makes of it --------------------------------------------------------------------------------------


def test_a_node_that_came_up_and_noted_nothing_has_turned_the_notes_off(tmp_path: Path):
    with closing(Notes(tmp_path)) as notes:
        notes.begin(functions=True)
        assert notes.read(node_is_up=False) is None
        assert kinds(notes.read(node_is_up=True)) == {"notes turned off"}


def test_what_is_written_into_the_pipe_is_not_believed(tmp_path: Path):
    with closing(Notes(tmp_path)) as notes:
        notes.begin(functions=True)
        folder = next(iter(notes.mounts))
        writer = os.open(folder / "pipe", os.O_WRONLY | os.O_NONBLOCK)
        os.write(writer, b"start\ncall\t/etc/passwd\t1\ncall\t/ws/install/a.py\tnan\ncall\nunseen\tx\ty\tz\n\xff\n\n")
        os.close(writer)
        assert notes.read(node_is_up=True) == Ran({"a.py": []})


def trial(**functions: list[int]) -> Trial:
    ran = Ran({name.replace("__", "/") + ".py": lines for name, lines in functions.items()})
    return Trial("status", "robot_controller", "lone_post", 0, True, "lockstep", None, ran=ran)


def placed(tmp_path: Path, installed: dict[str, bytes], handed_in: dict[str, bytes]) -> what_ran.Places:
    for path, data in installed.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(data)
    ran = Ran({path: [1] for path in installed})
    shown = Trial("status", "robot_controller", "lone_post", 0, True, "lockstep", None, ran=ran)
    return what_ran.places({"status": shown}, [PythonFile(path, data) for path, data in handed_in.items()], tmp_path)


def test_an_installed_file_is_the_one_that_was_handed_in_with_its_content(tmp_path: Path):
    found = placed(
        tmp_path,
        {f"{SITE}/p/a.py": b"A = 1\n", f"{SITE}/p/__init__.py": b"", "lib/p/node": b"#!/other/python3\nrun()\n"},
        {
            "p/a.py": b"A = 1\n",
            "p/__init__.py": b"",
            "test/__init__.py": b"",
            "scripts/node": b"#!/bin/python3\nrun()\n",
        },
    )
    assert found.paths == {
        f"{SITE}/p/a.py": "p/a.py",
        f"{SITE}/p/__init__.py": "p/__init__.py",
        "lib/p/node": "scripts/node",
    }
    assert found.left == {}


def test_what_the_build_has_made_is_named_by_its_place_in_the_package(tmp_path: Path):
    found = placed(tmp_path, {f"{SITE}/p/a.py": b"B = 2\n"}, {"p/a.py": b"A = 1\n"})
    assert found.left == {"p/a.py": f"{SITE}/p/a.py"}


def test_generated_types_and_programs_of_entry_points_are_not_the_packages_own(tmp_path: Path):
    entry = (
        "#!/usr/bin/python3\n# EASY-INSTALL-ENTRY-SCRIPT: 'p==1','console_scripts','node'\nimport re\nimport sys\n\n"
        "# for compatibility with easy_install; see #2198\n__requires__ = 'p==1'\n"
    )
    found = placed(tmp_path, {f"{SITE}/p/srv/_set_speed.py": b"def f(): ...\n", "lib/p/node": entry.encode()}, {})
    assert f"{SITE}/p/srv/_set_speed.py" not in found.paths


def test_a_flag_names_kind_file_and_trials():
    def shown(name: str) -> Trial:
        words = ["code made at run time: a string, by lib/p/node:7", "code made at run time: a string, by lib/p/node:9"]
        return Trial(name, "robot_controller", "lone_post", 0, True, "lockstep", None, ran=Ran(unseen=words))

    (flag,) = integrity_flags({name: shown(name) for name in ("status", "wall_fast")})
    assert (flag.kind, flag.where, flag.trial) == ("code made at run time", "lib/p/node", "status, wall_fast")
    assert "lib/p/node:7" in flag.what
    assert flag.concerns == ["what ran", "student tests", "mutation"]


def test_who_made_unseen_code_run_is_named_by_the_file_handed_in(tmp_path: Path):
    """Without one, as of a thread, the grading ended with an IndexError."""
    (tmp_path / "lib/p").mkdir(parents=True)
    (tmp_path / "lib/p/node").write_bytes(b"run()\n")
    words = [
        "code made at run time: a string, by lib/p/node:7",
        "code made at run time: a string",
        "notes turned off: x",
    ]
    shown = Trial("status", "robot_controller", "lone_post", 0, True, "lockstep", None, ran=Ran(unseen=words))
    found = what_ran.places({"status": shown}, [PythonFile("scripts/node", b"run()\n")], tmp_path)
    placed = what_ran.in_package(shown, found)
    assert placed.ran == Ran(unseen=["code made at run time: a string, by scripts/node:7", *words[1:]])
    assert len(integrity_flags({"status": placed})) == 3


def test_an_archive_is_flagged_once_whoever_imports_from_it():
    words = [f"archive: share/p/table, by share/p/table/{name}.py:1" for name in "ab"] + ["archive: share/p/table"]
    shown = Trial("status", "robot_controller", "lone_post", 0, True, "lockstep", None, ran=Ran(unseen=words))
    assert [(flag.kind, flag.where) for flag in integrity_flags({"status": shown})] == [("archive", "share/p/table")]
