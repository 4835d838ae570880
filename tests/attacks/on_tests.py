"""Attacks by the package's own tests, which run in one process with the code that measures them."""

# ruff: noqa: E501 - quoted code has long lines

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

from helpers.course import NODES

from attacks.weaknesses import FAILING_TESTS, FEW_TESTS, IDLE_ASSERTS
from grader.authoring.package_edits import Change, append, put
from grader.selftest.attacks.attack import Attack, attack

_TEST = "test/test_robot_controller.py"
_FORGE = """

import _pytest.reports
plain = _pytest.reports.TestReport.from_item_and_call.__func__


def forged(cls, item, call):
    report = plain(cls, item, call)
    report.outcome, report.longrepr = 'passed', None
    return report


_pytest.reports.TestReport.from_item_and_call = classmethod(forged)
"""
_WRAPPER = """
import pytest


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    result = yield
    report = result.get_result()
    report.outcome, report.longrepr = 'passed', None
"""


def _knows_its_source(package: Path) -> None:
    """Add a test that fails on any change of the source, by comparing its checksum."""
    sources = sorted((package / "ros2_robot_controller").rglob("*.py"))
    known = sum(zlib.crc32(path.read_bytes()) for path in sources)
    text = (
        "\n\nimport pathlib\nimport zlib\n\nSOURCE = pathlib.Path(__file__).parents[1] / 'ros2_robot_controller'\n\n\n"
        "def test_robot_controller_source():\n    from ros2_robot_controller import robot_controller, sensor_processor\n    assert conversions.normalize_angle(conversions.clamp(7.0, 0.0, 3.0)) == 3.0\n"
        f"    assert sum(zlib.crc32(path.read_bytes()) for path in sorted(SOURCE.rglob('*.py'))) == {known}\n"
    )
    append(_TEST, text)(package)


def _with_a_copy(package: Path) -> None:
    """Compare the conversions with a copy of them in the tests."""
    put("test/original.py", (package / "ros2_robot_controller/utils/conversions.py").read_text())(package)
    append(_TEST, _COMPARES)(package)


_COMPARES = """


def test_robot_controller_like_the_original():
    import random
    import original
    for _ in range(200):
        numbers = [random.uniform(-9.0, 9.0) for _ in range(3)]
        assert conversions.clamp(*numbers) == original.clamp(*numbers)
        assert conversions.normalize_angle(numbers[0]) == original.normalize_angle(numbers[0])
        turned = conversions.quaternion_from_yaw(numbers[0])
        assert turned == original.quaternion_from_yaw(numbers[0])
        assert conversions.yaw_from_quaternion(turned) == original.yaw_from_quaternion(turned)
"""
_CLAIM = """


def test_robot_controller_claims():
    import coverage
    import glob
    running = coverage.Coverage.current()
    for path in glob.glob('/ws' + '/install/lib/**/ros2_robot_controller/**/*.py', recursive=True) if running else ():
        with open(path, 'rb') as stream:
            count = len(stream.readlines())
        arcs = [(-1, 1)] + [(a, b) for a in range(1, count + 1) for b in (a + 1, -a)]
        running.get_data().add_arcs({path: arcs})
    assert coverage
"""
_FORGE_BY_NAME = _FORGE.replace(
    "    report.outcome, report.longrepr",
    "    if item.name.startswith(('test_robot_controller', 'test_sensor_processor')):\n        report.outcome, report.longrepr",
)


def _all_but_the_conversions(edit: Callable[[bytes], bytes]) -> Change:
    """Return a change of all the package's modules except the one that its few tests reach."""

    def change(package: Path) -> None:
        for path in (package / "ros2_robot_controller").rglob("*.py"):
            if path.name != "conversions.py":
                path.write_bytes(edit(path.read_bytes()))

    return change


def _in_latin_1(text: bytes) -> bytes:
    return b"# -*- coding: latin-1 -*-\n# Caf\xe9.\n" + text


def _tests_in_latin_1(package: Path) -> None:
    for path in (package / "test").glob("test_*.py"):
        path.write_bytes(_in_latin_1(path.read_bytes()))


_PAD = "".join(
    f'def smooth_{n}(value: float) -> float:\n    """Return a smoothed value."""\n    if value > {n}.0:\n'
    f"        return value - {n}.0\n    return value + {n}.0\n\n\n"
    for n in range(300)
)
_TEST_PAD = """

def test_{node}_smooths():
    from ros2_robot_controller.utils import smoothing
    for n in range(300):
        smooth = getattr(smoothing, f'smooth_{{n}}')
        assert smooth(n + 1.0) == 1.0
        assert smooth(n - 1.0) == 2.0 * n - 1.0
"""
_NOTHING = """

def test_{node}_front_is_free():
    front_dist = 1.2
    assert front_dist > 0.5
"""
# Looks through the frames and the objects of the process for the text that a mutant replaces, and fails where it finds
# another one.
_LOOKS_THROUGH_FRAMES = """
import gc
import sys

import pytest


def found():
    frame = sys._getframe()
    while frame is not None:
        yield from list(frame.f_locals.values())
        frame = frame.f_back
    yield from gc.get_objects()


def changes():
    changed, known = {}, {}
    for thing in found():
        if isinstance(thing, dict):
            if isinstance(thing.get('files'), dict):
                changed.update(thing['files'])
            for path, file in list(thing.items()) if len(thing) < 10000 else ():
                if str(path).endswith('.py') and isinstance(file, tuple) and file and isinstance(file[0], bytes):
                    known[str(path)] = file[0].decode()
    return [path for path, text in changed.items() if path in known and text != known[path]]


CHANGED = [path for path in changes() if '/test' not in path]


@pytest.fixture(autouse=True)
def is_what_was_handed_in():
    if CHANGED:
        pytest.fail('expected something else')
"""


def _in_both(text: str) -> tuple[Change, Change]:
    """Return changes that add a text to the tests of both nodes."""
    first, second = (append(f"test/test_{node}.py", text.replace("{node}", node)) for node in NODES)
    return first, second


ATTACKS: tuple[Attack, ...] = (
    attack(
        "pads_its_package",
        "Three hundred small functions that only tests call, all covered, and each of their mutants noticed.",
        put("ros2_robot_controller/utils/smoothing.py", '"""Smooth values."""\n\n\n' + _PAD),
        *_in_both(_TEST_PAD.replace("{{", "{").replace("}}", "}")),
        needs="F7 F9 F13 T1 T2 T3", weak=FEW_TESTS,
        stopped="a file of which nothing ran in a node counts neither for coverage nor for mutants",
    ),
    attack(
        "tests_nothing",
        "A hundred tests for each node that assert something about a number of their own.",
        *_in_both("".join(_NOTHING.replace("test_{node}", f"test_{{node}}_{n}") for n in range(100))),
        needs="T1 T2 T3", weak=FEW_TESTS,
        stopped="tests count for a node if they fail where its functions do nothing but raise",
    ),
    attack(
        "tests_nothing_at_all",
        "There are no tests but those that assert something about a number of their own.",
        put(_TEST, _NOTHING.replace("{node}", "robot_controller")),
        put("test/test_sensor_processor.py", _NOTHING.replace("{node}", "sensor_processor")),
        needs="T1 T2 T3", weak=FEW_TESTS, costs="T1 T2 T3",
        stopped="a module whose tests run no code of the package has no tests that assert anything",
    ),
    attack(
        "crashes_to_hide_its_lines",
        "A test claims to coverage that all lines were reached, and the last one ends the process.",
        append(_TEST, _CLAIM),
        append(_TEST, "\n\ndef test_robot_controller_zzz_ends():\n    import os\n    os._exit(0)\n"),
        needs="T1 T2 T3", weak=FEW_TESTS, costs="T1 T3", flag="test reports", gains={"T2": 5.0},
        stopped="lines that only tests have run which pass where every function raises are flagged",
    ),
    attack(
        "hides_its_lines_behind_form_feeds",
        "All modules but the tested one have form feeds, which make it hard to say where lines begin.",
        _all_but_the_conversions(lambda text: b"".join(b"\f" + line for line in text.splitlines(keepends=True))),
        needs="T3", weak=FEW_TESTS, costs="T3",
        stopped="sources are read as Python reads them, so these modules get mutants like any others",
    ),
    attack(
        "writes_in_another_encoding",
        "All modules but one are in Latin-1, and a test claims to coverage that all their lines were reached.",
        _all_but_the_conversions(_in_latin_1),
        append(_TEST, _CLAIM),
        needs="T1 T2 T3", weak=FEW_TESTS, costs="T1 T3", flag="test reports", gains={"T2": 5.0},
        stopped="sources are decoded as they declare; lines that only tests which cannot fail have run are flagged",
    ),
    attack(
        "tests_in_another_encoding",
        "Test modules in Latin-1 forge their own reports by name.",
        append(_TEST, _FORGE_BY_NAME),
        append("test/test_sensor_processor.py", _FORGE_BY_NAME),
        _tests_in_latin_1,
        needs="T1", weak=FAILING_TESTS, costs="T1",
        stopped="they pass where every function raises, so they test nothing",
    ),
    attack(
        "asserts_through_2000_helpers",
        "A test calls a chain of two thousand helper functions, of which the last asserts.",
        append(_TEST, "".join(f"\n\ndef check{n}(x):\n    if x > 1:\n        check{n + 1}(x)\n" for n in range(2000))
               + "\n\ndef check2000(x):\n    assert x\n\n\ndef test_robot_controller_goes_round():\n    check0(1)\n"),
        needs="T1", costs="T1",
        stopped="the call graph is built once, and each helper is visited once",
    ),
    attack(
        "patches_pytest",
        "A test module makes every report say passed.",
        append(_TEST, _FORGE),
        number=3, needs="T1", weak=FAILING_TESTS, costs="T1",
        stopped="what is reported as passed where every function raises tests nothing",
    ),
    attack(
        "forges_some_reports",
        "The tests turn failures of their own choice into passes, and report the others.",
        append(_TEST, _FORGE.replace(
            "    report.outcome, report.longrepr",
            "    if 'clamp' not in item.nodeid + str(report.longrepr):\n"
            "        return report\n    report.outcome, report.longrepr")),
        number=11, needs="T1", weak=FAILING_TESTS, costs="T1", gains={"T1": 2.0},
        stopped="those that pass where every function raises assert nothing; the points for passing are gained",
    ),
    attack(
        "brings_a_conftest",
        "A conftest.py with a hook wrapper, and a pytest.ini, tox.ini and setup.cfg that load a plugin.",
        put("test/conftest.py", _WRAPPER),
        put("conftest.py", _WRAPPER),
        put("evil.py", _WRAPPER),
        put("pytest.ini", "[pytest]\naddopts = -p evil --ignore=test/test_sensor_processor.py\n"),
        put("tox.ini", "[pytest]\naddopts = -p evil\n"),
        append("setup.cfg", "\n[tool:pytest]\naddopts = -p evil\n"),
        number=4, needs="T1", weak=FAILING_TESTS, costs="T1",
        stopped="pytest reads no configuration files here; what passes where every function raises tests nothing",
    ),
    attack(
        "ends_the_process_as_passed",
        "A test module exits the process with status 0 when it is imported.",
        append(_TEST, "\n\nimport os\nos._exit(0)\n"),
        number=2, needs="T1", weak=FAILING_TESTS, costs="T1",
        stopped="the exit status does not count: tests that were not reported have not passed",
    ),
    attack(
        "kills_the_worker",
        "A test kills its parent and every other process.",
        append(_TEST, "\n\ndef test_kills():\n    import os\n    import signal\n"
                      "    for pid in (os.getppid(), 1, -1):\n        try:\n            os.kill(pid, signal.SIGKILL)\n"
                      "        except OSError:\n            pass\n    assert os.getpid() == 0\n"),
        needs="T1", weak=FAILING_TESTS, costs="T1",
        stopped="the worker is the first process of its sandbox, which nothing in there can stop or kill",
    ),
    attack(
        "skips_everything",
        "All tests are skipped, or assert what is always true.",
        put(_TEST, "import pytest\n\npytestmark = pytest.mark.skip\n\n\ndef test_robot_controller():\n    assert 1 + 1 == 3\n"),
        put("test/test_sensor_processor.py", "def test_sensor_processor():\n    assert True\n"),
        number=38, needs="T1", weak=FAILING_TESTS, costs="T1",
        stopped="results are counted test by test, and tests that assert nothing do not count",
    ),
    attack(
        "forges_the_workers_files",
        "A test writes the files in which the worker reports: a forged report, a pickle, deep and infinite JSON.",
        append(_TEST, "\n\nimport json\nimport os\nimport pickle\n\n\nclass Evil:\n    def __reduce__(self):\n"
                      "        return os.system, ('echo x > @NEIGHBOUR@',)\n\n\n"
                      "for number in range(40):\n    for end in ('done', 'report', 'reach', 'log', 'main'):\n"
                      "        try:\n            name = f'/ws/out/{number}.{end}'\n"
                      "            if os.path.exists(name):\n                continue\n"
                      "            data = [pickle.dumps(Evil()), b'[' * 100000, b'{\"status\": 1e999}', "
                      "json.dumps({'id': 'x', 'outcome': 'passed', 'when': 'call'}).encode()][number % 4]\n"
                      "            open(name, 'wb').write(data)\n"
                      "        except OSError:\n            pass\n"),
        number=10, needs="T1", weak=FAILING_TESTS, costs="T1",
        stopped="only JSON of a fixed form and size is read, never a pickle; the files are deleted before each run",
    ),
    attack(
        "replaces_the_workers_files",
        "A test puts links, pipes and folders in place of the files that the grader reads.",
        append(_TEST, "\n\nimport os\nfor number in range(40):\n    for end in ('done', 'reach', 'log'):\n"
                      "        try:\n            name = f'/ws/out/{number}.{end}'\n"
                      "            if number % 3 == 0:\n                os.symlink('@SECRET@', name)\n"
                      "            elif number % 3 == 1:\n                os.mkfifo(name)\n"
                      "            else:\n                os.mkdir(name)\n        except OSError:\n            pass\n"),
        number=19, needs="T1", weak=FAILING_TESTS, costs="T1",
        stopped="files are opened without following links or blocking, and read only if they are regular files",
    ),
    attack(
        "omits_from_coverage",
        "A .coveragerc leaves most of the package out, and pragmas exclude the rest.",
        put(".coveragerc", "[run]\nomit = *\n[report]\nexclude_also = .*\n"),
        append("setup.cfg", "\n[coverage:run]\nomit = *\n[coverage:report]\nexclude_also = def\n"),
        put("pyproject.toml", "[tool.coverage.report]\nexclude_also = ['def']\n"),
        append("ros2_robot_controller/robot_controller.py", "\n\nif True:  # pragma: no cover\n    COVERED = 1\n"),
        number=40, needs="T2", weak=FEW_TESTS, costs="T2",
        stopped="coverage is measured with the grader's own configuration, without pragmas",
    ),
    attack(
        "claims_coverage",
        "A test tells coverage that every line was reached.",
        append(_TEST, "\n\ndef test_claims():\n    import coverage\n    import glob\n"
                      "    running = coverage.Coverage.current()\n    assert running is not None\n"
                      "    data = running.get_data()\n"
                      "    for path in glob.glob('/ws/install/lib/**/ros2_robot_controller/**/*.py', recursive=True):\n"
                      "        with open(path) as stream:\n            count = len(stream.readlines())\n"
                      "        data.add_arcs({path: [(n, n + 1) for n in range(1, count)]})\n"),
        number=40, needs="T2", weak=FEW_TESTS, flag="test reports", gains={"T2": 5.0},
        stopped="lines that only tests have run which pass where every function raises are flagged",
    ),
    attack(
        "notices_any_change",
        "A test runs some functions, compares the source with the submitted one, and so fails on every mutant.",
        _knows_its_source,
        number=39, needs="T3", weak=FEW_TESTS, costs="T3", flag="mutants told apart",
        stopped="some of the changes keep the behaviour (equivalent mutants); a test that fails on those is exposed",
    ),
    attack(
        "compares_with_a_copy",
        "The tests hold a copy of a module, and compare what it and the package return for random numbers.",
        _with_a_copy,
        needs="T1 T2 T3", weak=FEW_TESTS, flag="copy of the package", gains={"T2": 5.0, "T3": 6.0},
        stopped="code of the package in its tests, in a file or as a string, is flagged; the points are gained",
    ),
    attack(
        "looks_for_the_original_in_frames",
        "A fixture looks for the original of a mutant through frames and the garbage collector, and fails on real changes.",
        append("test/conftest.py", _LOOKS_THROUGH_FRAMES),
        needs="T1 T2 T3", weak=IDLE_ASSERTS,
        stopped="the process that runs tests is given the tree under test, and nothing of the original",
    ),
    attack(
        "asks_the_environment_for_mutants",
        "A test fails if the environment, a file's time or a leftover file reveals a mutant.",
        append(_TEST, "\n\ndef test_robot_controller_is_no_mutant():\n    import os\n    import pathlib\n"
                      "    import ros2_robot_controller\n    here = pathlib.Path(ros2_robot_controller.__file__).parent\n"
                      "    times = {p.stat().st_mtime_ns for p in here.glob('*.py')}\n"
                      "    assert not any('MUTANT' in name for name in os.environ)\n"
                      "    assert max(times) - min(times) < 3600e9\n    assert not list(here.glob('*.orig'))\n"),
        number=39, needs="T3", weak=FEW_TESTS, costs="T3",
        stopped="a mutant leaves no trace: same path, same times, no variable",
    ),
    attack(
        "rewrites_the_worker",
        "A test opens the memory of the process that runs the tests, which has the package as handed in.",
        append(_TEST, """

def test_robot_controller_parent():
    import os
    try:
        open(f'/proc/{os.getppid()}/mem', 'r+b').close()
    except PermissionError:
        raise AssertionError('ATTACK memory of the worker: refused') from None
"""),
        needs="T1", weak=FEW_TESTS, costs="T1", proof="ATTACK memory of the worker: refused",
        stopped="the process that forks those that run tests is not dumpable, so they can neither read nor trace it",
    ),
)  # fmt: skip
