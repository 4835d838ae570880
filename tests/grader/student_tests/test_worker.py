"""What tests find in their sandbox, and what they can do to the process that runs them: nothing."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest
from helpers import beside
from helpers.course import COURSE
from submissions import toy

from grader.student_tests import warm_worker
from grader.student_tests.discover import discover_tests
from grader.student_tests.source import SuiteRun, run_suite

TEXTS = beside(__file__)

pytestmark = [pytest.mark.sandbox]

USE = "from ros2_robot_controller import robot_controller\n"


def module(name: str, text: str) -> dict[str, str]:
    return {f"test/{name}/test_it.py": USE + dedent(text)}


def run(folder: Path, files: dict[str, str], modules: dict[str, str] | None = None, seconds: float = 20.0) -> SuiteRun:
    made = toy.make(folder, files, modules)
    return run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE, seconds=seconds)


@pytest.fixture
def one_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let one worker run all modules, so that each finds what the one before has left behind."""
    monkeypatch.setattr(warm_worker, "WORKERS", 1)


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> SuiteRun:
    files: dict[str, str] = {}
    for name, text in TEXTS["HONEST"].items():
        files |= module(name, text)
    return run(tmp_path_factory.mktemp("toy"), files)


def test_no_test_can_stop_or_kill_its_worker(tmp_path: Path):
    """The worker was gone, and the grader waited until it noticed; what came after had to wait for another one."""
    text = """
        import contextlib
        import os
        import pytest

        @pytest.mark.parametrize("number", [9, 15, 19])
        def test_it(number):
            os.kill(os.getppid(), number)
            with contextlib.suppress(ProcessLookupError):
                os.kill(-1, number)
            assert robot_controller.stop_distance(0.5)
    """
    found = run(tmp_path, module("kills", text))
    assert [(made.passed, made.errors, made.failures) for made in found.tests.modules] == [(3, 0, [])]


def test_a_worker_that_takes_the_place_of_another_lives_as_long_as_the_others(tmp_path: Path):
    """It ended with the thread in which it was missed, and then the sandbox could not be closed: no grading."""
    made = toy.make(tmp_path, {"test/test_it.py": "def test_it():\n    assert True\n"})
    with warm_worker.start_workers(made.package, made.install) as workers:

        def kill(_number: int) -> None:
            worker = workers._start(9, 0)
            worker.process.kill()
            workers._idle.get()
            workers._idle.put(worker)

        workers.map(kill, [0])
        for _ in range(2):
            asked = [warm_worker.ModuleRequest("test/test_it.py")] * 2
            assert [ran.failure for ran in workers.map(workers.run, asked)] == ["", ""]
        assert all(worker is not None and worker.alive for worker in (workers._idle.get(), workers._idle.get()))


@pytest.mark.slow  # a suite of four modules
def test_what_tests_may_expect_of_pytest_is_there(ran: SuiteRun):
    assert [module.failures for module in ran.tests.modules] == [[]] * len(TEXTS["HONEST"])


@pytest.mark.slow  # the same suite
def test_lines_that_a_started_program_reaches_count(ran: SuiteRun):
    [processor] = [file for file in ran.tests.coverage if file.path.endswith("sensor_processor.py")]
    line = toy.PROCESSOR.splitlines().index("        return first + 1") + 1
    assert line not in processor.missing
    assert line + 1 in processor.missing


def test_the_worker_is_closed_to_the_tests_that_it_runs(tmp_path: Path):
    """It has the package as handed in, and restores it before each run: a test read and rewrote its memory."""
    text = """
        import os
        import pytest

        @pytest.mark.parametrize("name", ["mem", "environ", "maps", "fd/0"])
        def test_it(name):
            os.stat(f"/proc/self/{name}")
            open(f"/proc/{os.getpid()}/mem", "r+b").close()
            with pytest.raises(PermissionError):
                open(f"/proc/{os.getppid()}/{name}", "rb")
    """
    found = run(tmp_path, module("looks", text))
    assert (found.tests.modules[0].passed, found.tests.modules[0].failures) == (4, [])


@pytest.mark.usefixtures("one_worker")
def test_forged_byte_code_is_gone_before_the_next_run(tmp_path: Path):
    """Python would load it in place of the text: where byte code belongs, where a link leads, of another kind."""
    forge = """
        import importlib.util
        import os
        import py_compile
        import shutil
        from pathlib import Path

        def test_it():
            assert robot_controller.TOP_SPEED == 0.5
            home = Path(robot_controller.__file__)
            for number, name in enumerate(("robot_controller", "sensor_processor")):
                Path("/tmp/forged.py").write_text("TOP_SPEED = 7.0")
                forged = importlib.util.cache_from_source(str(home.with_name(f"{name}.py")))
                unchecked = py_compile.PycInvalidationMode.UNCHECKED_HASH
                py_compile.compile("/tmp/forged.py", forged, invalidation_mode=unchecked)
            os.mkdir("/ws/out/kept")
            shutil.copy(forged, "/ws/out/kept/" + os.path.basename(forged).replace("sensor_processor", "helper"))
            os.symlink("/ws/out/kept", "/ws/package/test/b_honest/__pycache__")
            for package in (Path("/ws/package/ros2_robot_controller"), home.parent):
                (package / "extra.pyc").write_bytes(Path(forged).read_bytes())
    """
    honest = """
        from pathlib import Path
        import helper
        from ros2_robot_controller import sensor_processor

        def test_it():
            assert helper.TOP_SPEED == 0.25
            assert robot_controller.stop_distance(0.5)
            assert robot_controller.TOP_SPEED == 0.5
            assert not hasattr(sensor_processor, "TOP_SPEED")
            assert list(Path(robot_controller.__file__).parent.glob("*.pyc")) == []
    """
    helper = {"test/b_honest/helper.py": "TOP_SPEED = 0.25\n"}
    found = run(tmp_path, module("a_forges", forge) | module("b_honest", honest) | helper)
    assert [made.failures for made in found.tests.modules] == [[], []]


@pytest.mark.slow  # a suite more
def test_a_warning_of_the_compiler_is_still_the_tests_own(tmp_path: Path):
    """Compiled once and for all, a module would warn nobody any more."""
    text = """
        import sys

        def test_it():
            assert robot_controller.stop_distance(0.5) == 0.0625, "\\d"
    """
    found = run(tmp_path, module("warns", text))
    assert found.tests.modules[0].passed == 1
    assert "DeprecationWarning: invalid escape sequence" in found.tests.modules[0].output_tail
