"""`mine` and `bench`: the student's modules and nodes, tried in the kernel without a robot."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack

import pytest
import rclpy
from helpers.course import PACKAGE
from helpers.notebook_fixtures import as_in_a_kernel
from rclpy.context import Context

from grader.notebook import bench, checkpoints, interface_types, lessons, mine, tables, tries
from grader.notebook.workspace import Workspace

pytestmark = pytest.mark.ros


@pytest.fixture
def solved(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> Iterator[Workspace]:
    """The package as notebook 07 leaves it, importable as in a kernel."""
    checkpoints.start_at(workspace, "08")
    monkeypatch.syspath_prepend(str(workspace.package))
    with as_in_a_kernel(workspace):
        yield workspace


def test_a_module_that_is_missing_is_said_once_and_makes_a_row(
    workspace: Workspace, capsys: pytest.CaptureFixture[str]
):
    globals()["motion"] = mine("utils.nowhere")
    assert "not yet: utils.nowhere cannot be imported" in capsys.readouterr().out
    tries({"motion.ramp(0.0, 0.5, 0.1)": 0.1})
    assert capsys.readouterr().out == "NOT YET  motion.ramp(0.0, 0.5, 0.1)  -, wanted 0.1\n0 of 1 right\n"


def test_time_on_a_bench_stands_until_it_is_advanced(solved: Workspace):
    driver = bench("driver.Driver")
    assert driver.advance(0.3) == [(0.0, 0.0)] * 3
    assert driver._now() == pytest.approx(0.3)
    driver.node._speed = 0.5
    driver.node._scan_time = 0.3
    assert driver.advance(0.2) == [(0.1, 0.0), (0.2, 0.0)]
    driver.close()


@pytest.mark.parametrize(
    ("module", "old", "new", "said"),
    [
        (
            "driver.Driver",
            "settings.declare(self, SETTINGS)",
            "raise ValueError('no')",
            "Driver() raised ValueError: no",
        ),
        ("navigator.Navigator", "        super().__init__(**node_options)\n", "", "begin with super().__init__(...)?"),
    ],
)
def test_a_node_that_raises_at_its_start_is_named(
    solved: Workspace, capsys: pytest.CaptureFixture[str], module: str, old: str, new: str, said: str
):
    path = solved.package / PACKAGE / f"{module.partition('.')[0]}.py"
    path.write_text(path.read_text().replace(old, new))
    assert not hasattr(bench(module), "advance")
    assert capsys.readouterr().out.endswith(f"{said}\n")


@pytest.fixture
def checked_fields() -> Iterator[None]:
    """Check fields as in a kernel, and as before afterwards."""
    getenv = os.getenv
    interface_types.check_fields()
    yield
    os.getenv = getenv
    for name, module in list(sys.modules.items()):
        if interface_types.MESSAGE.fullmatch(name):
            setattr(module, "ros_python_check_fields", "")  # noqa: B010 - mypy knows no such name


def test_an_int_in_a_float_field_is_said_when_it_is_set(checked_fields: None):
    """`command.linear.x = 1` arrived as 0.0, without a word, in the learner's first hour."""
    from geometry_msgs.msg import Twist

    sys.modules.pop("std_msgs.msg._float64", None)  # one that is imported later is checked, too
    later = importlib.import_module("std_msgs.msg._float64").Float64
    with pytest.raises(AssertionError, match="The 'x' field must be of type 'float'"):
        Twist().linear.x = 1
    with pytest.raises(AssertionError, match="The 'data' field must be"):
        later(data=1)


def test_programs_that_a_cell_starts_see_messages_as_ros_does(checked_fields: None):
    code = "from std_msgs.msg import Float32; print(Float32(data=1).data)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "1\n"


def test_an_int_in_a_float_field_is_said_on_the_bench(solved: Workspace, checked_fields: None):
    """`self._speed = 0` passed every try and most checks, and ended the node at the first get_status after a goal."""
    navigator = bench("navigator.Navigator")
    navigator.node._speed = 0
    with pytest.raises(AssertionError, match="The 'speed' field must be of type 'float'"):
        navigator.ask("get_status")
    with pytest.raises(AssertionError, match="The 'x' field must be of type 'float'"):
        navigator._publish(mine("utils.motion").Command(1, 0.0))


NAVIGATE = "navigator.begin(navigator._navigate, Handle(3.0, 2.0)).done()"


def test_a_forgotten_await_is_said(solved: Workspace, capsys: pytest.CaptureFixture[str]):
    """The row said `KeyError: <rclpy.task.Future object at 0x...>`."""
    path = solved.package / PACKAGE / "navigator.py"
    path.write_text(path.read_text().replace("await goal.ending", "goal.ending"))
    globals().update(navigator=bench("navigator.Navigator"), Handle=lessons.Handle)
    tries({NAVIGATE: False, "Handel(3.0, 2.0)": None})
    first, second, _ = capsys.readouterr().out.splitlines()
    assert ": a future is not yet its result; `await` it" in first
    assert "name 'Handel' is not defined" in second
    assert "run the cells above this one first" in second
    globals()["navigator"].close()


@pytest.mark.parametrize(
    "waiting",
    ["rclpy.spin_until_future_complete(self, goal.ending)", "while not goal.ending.done(): pass"],
    ids=["spins", "loops"],
)
def test_a_call_that_never_comes_back_is_ended_with_its_line(
    solved: Workspace, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, waiting: str
):
    """The cell hung without a word, until the kernel was restarted."""
    path = solved.package / PACKAGE / "navigator.py"
    text = (
        path.read_text()
        .replace("async def _navigate", "def _navigate")
        .replace(
            "ending = await goal.ending", f"import rclpy\n        {waiting}\n        ending = goal.ending.result()"
        )
    )
    path.write_text(text)
    line = 1 + next(n for n, row in enumerate(text.splitlines()) if waiting in row)
    monkeypatch.setattr(tables, "LIMIT_S", 1.0)
    if not rclpy.ok():
        rclpy.init()
    globals().update(navigator=bench("navigator.Navigator"), Handle=lessons.Handle)
    tries({NAVIGATE: False, "1 + 1": 2})
    said = capsys.readouterr().out
    assert f"hangs at navigator.py:{line}, in `_navigate`; `await` the future, or end the loop" in said
    assert said.endswith("0 of 2 right\n")
    rclpy.try_shutdown()


def test_a_service_that_returns_nothing_is_told_so(solved: Workspace, capsys: pytest.CaptureFixture[str]):
    path = solved.package / PACKAGE / "speed_server.py"
    path.write_text(path.read_text().replace("        return response\n", "", 1))
    server = bench("speed_server.SpeedServer")
    with pytest.raises(TypeError, match="callback of set_speed returned None; `return response`"):
        server.ask("set_speed", speed=0.3)
    with pytest.raises(LookupError, match="no service reset"):
        server.ask("reset")
    server.close()


def test_an_async_method_goes_on_when_its_future_is_done(solved: Workspace):
    from grader.notebook.lessons import Handle

    navigator, module, handle = bench("navigator.Navigator"), mine("navigator"), Handle(3.0, 2.0)
    task = navigator.begin(navigator._navigate, handle)
    assert not task.done()
    navigator._end_goal(module.Ending.CANCELED)
    navigator.advance(0.1)
    assert task.done()
    assert handle.said == ["canceled"]
    navigator.close()


def test_a_new_bench_takes_the_old_ones_place(solved: Workspace):
    first = bench("driver.Driver")
    second = bench("driver.Driver")
    assert not first._context.ok()
    assert second._context.ok()
    second.close()


def test_a_bench_finds_no_other_node(solved: Workspace):
    """Two benches of two students were in one domain, so the scan of one could reach the node of the other."""
    node = bench("driver.Driver").node
    with ExitStack() as stack:
        others = []
        for name in ("one", "two"):
            context = Context()
            rclpy.init(context=context, domain_id=node.context.get_domain_id())
            stack.callback(context.shutdown)
            others.append(rclpy.create_node(name, context=context))
            stack.callback(others[-1].destroy_node)
        deadline = time.monotonic() + 30
        while {"one", "two"} - set(others[0].get_node_names()):
            assert time.monotonic() < deadline, "two ordinary nodes did not find each other"
        assert node.get_node_names() == [node.get_name()]
        assert node.get_name() not in others[0].get_node_names()
