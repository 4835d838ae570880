"""However a launch ends, its processes end with it, each signalled once, and it leaves a record and no files."""

from __future__ import annotations

import os
import pty
import re
import signal
import sys
import uuid

import pytest
from helpers import running, until
from helpers.ros2_runs import COMMAND, environment, events, write


@pytest.fixture
def mark() -> str:
    """Return a number of seconds that no other process sleeps, to find ours by."""
    return f"600.{uuid.uuid4().int % 10**9:09d}"


def alive(mark: str) -> list[str]:
    return running(f"sleep\0{mark}\0")


def family(mark: str) -> str:
    """Return an entity: a process with a child that is never signalled itself, and a parameter file."""
    return f"demo('family', '{mark}', parameters=[{{'a': 1}}])"


@pytest.mark.parametrize(
    ("number", "code"),
    [
        (signal.SIGINT, 0),
        (signal.SIGTERM, -signal.SIGTERM),
        (signal.SIGHUP, -signal.SIGHUP),
    ],
    ids=lambda value: value.name if isinstance(value, signal.Signals) else "",
)
def test_no_orphan_after_a_signal(launch, tmp_path, mark, number, code):
    """The real launch leaves its nodes running after SIGTERM and SIGKILL (ros2/launch#666)."""
    started = launch(write(tmp_path, family(mark)))
    until(lambda: alive(mark))
    started.signal(number)
    assert started.end().code == code
    until(lambda: not alive(mark))
    until(lambda: not list(tmp_path.glob("launch_params_*")))


def test_a_launch_that_is_killed_takes_its_processes_with_it(launch, tmp_path, mark):
    started = launch(write(tmp_path, f"ExecuteProcess(cmd=['sleep', '{mark}'])"))
    until(lambda: alive(mark))
    started.signal(signal.SIGKILL)
    assert started.end().code == -signal.SIGKILL
    until(lambda: not alive(mark))


@pytest.mark.slow  # one more launch
def test_no_orphan_after_an_exception_during_the_launch(launch, tmp_path, mark):
    later = "TimerAction(period=0.3, actions=[demo('show', LaunchConfiguration('not_there'))])"
    run = launch(write(tmp_path, family(mark), later)).end()
    assert run.code == 1
    assert "Caught exception in launch" in run.out
    assert "launch configuration 'not_there' does not exist" in run.out
    until(lambda: not alive(mark))


def test_nothing_starts_when_the_description_fails_in_the_middle(launch, tmp_path, mark):
    """The real launch has started the first process by then, and leaves it running."""
    run = launch(write(tmp_path, family(mark), "Node(package='demo', executable='nope')")).end()
    assert run.code == 1
    assert re.search(r"executable 'nope' not found .*; it holds .*show.* \(\S*made.launch.py, line 11\)", run.out)
    assert [e["event"] for e in run.events] == ["launch_ended"]
    assert run.events[-1]["exit_code"] == 1
    assert not alive(mark)


def test_a_stubborn_process_gets_sigint_then_sigterm_then_sigkill(launch, tmp_path):
    started = launch(
        write(tmp_path, "demo('stubborn')", "demo('wait')"), "sigterm_timeout:=0.3", "sigkill_timeout:=0.3"
    )
    started.wait_for("stubborn-1", "wait-2")
    started.signal(signal.SIGINT)
    run = started.end()
    assert run.ended("stubborn-1")["sent"] == ["SIGINT", "SIGTERM", "SIGKILL"]
    assert run.ended("stubborn-1")["signal"] == "SIGKILL"
    assert run.ended("wait-2")["sent"] == ["SIGINT"]
    assert "failed to terminate '0.3' seconds after receiving 'SIGINT', escalating to 'SIGTERM'" in run.out


@pytest.mark.slow  # one more launch
def test_sigint_reaches_a_process_below_a_shell(launch, tmp_path):
    """It once went to the shell alone, which waits for its child; SIGTERM then killed both."""
    child, ready = tmp_path / "child", tmp_path / "ready"
    child.write_text(f"trap 'echo heard; exit 0' INT\ntouch {ready}\nwhile :; do sleep 0.05; done\n")
    started = launch(write(tmp_path, f"ExecuteProcess(cmd=['sh {child}; exit $?'], shell=True, output='screen')"))
    until(ready.exists)
    started.signal(signal.SIGINT)
    run = started.end()
    assert run.out.count("heard") == 1
    assert [e["sent"] for e in run.events if e["event"] == "ended"] == [["SIGINT"]]


def test_ctrl_c_at_a_terminal_reaches_a_process_once_though_it_is_pressed_twice(demo, tmp_path):
    """A terminal signals its foreground group. The processes are in others; the launch passes the signal on once."""
    file, record = write(tmp_path, "demo('counting')"), tmp_path / "record.jsonl"
    pid, terminal = pty.fork()
    if pid == 0:
        words = [sys.executable, str(COMMAND), "launch", "--record", str(record), str(file)]
        os.execve(sys.executable, words, environment(demo, tmp_path))
    text = b""
    while b"] ready" not in text:
        text += os.read(terminal, 4096)
    os.write(terminal, b"\x03")
    while b"user interrupted" not in text:
        text += os.read(terminal, 4096)
    os.write(terminal, b"\x03")
    while True:
        try:
            text += os.read(terminal, 4096)
        except OSError:
            break
    _, status = os.waitpid(pid, 0)
    os.close(terminal)
    assert os.waitstatus_to_exitcode(status) == 0
    assert text.count(b"[counting-1] INT") == 1
    assert b"again, ignoring" in text
    (ended,) = [e for e in events(record) if e["event"] == "ended"]
    assert (ended["exit_code"], ended["sent"]) == (1, ["SIGINT"])


@pytest.mark.slow  # one more launch
def test_no_orphan_when_the_terminal_is_closed(demo, tmp_path, mark):
    """Writing to a closed terminal fails, and that must not stop the launch from ending its processes."""
    file = write(tmp_path, family(mark))
    pid, terminal = pty.fork()
    if pid == 0:
        os.execve(sys.executable, [sys.executable, str(COMMAND), "launch", str(file)], environment(demo, tmp_path))
    until(lambda: alive(mark))
    os.close(terminal)
    _, status = os.waitpid(pid, 0)
    assert os.waitstatus_to_exitcode(status) == -signal.SIGHUP
    until(lambda: not alive(mark))


def test_the_record_holds_how_each_process_ended(launch, tmp_path):
    run = launch(write(tmp_path, "demo('fail', name='n', namespace='ns')", "demo('show')")).end()
    (started,) = [e for e in run.events if e["event"] == "started" and e["process"] == "fail-1"]
    assert (started["package"], started["executable"], started["node"]) == ("demo", "fail", "/ns/n")
    ended = run.ended("fail-1")
    assert (ended["exit_code"], ended["signal"], ended["sent"]) == (3, None, [])
    assert ended["pid"] == started["pid"]
    assert run.ended("show-2")["exit_code"] == 0
    assert run.events[-1]["event"] == "launch_ended"
