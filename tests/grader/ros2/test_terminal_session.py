"""The session of docs/ros2-session.md, typed into real terminals."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from helpers import beside
from helpers.course import COURSE
from helpers.ros2_runs import COMMAND
from helpers.terminal import Terminal, desk, needs_zsh

from grader import KIT, building
from grader.host import ros_env

TEXTS = beside(__file__)

PAGE = KIT / "docs" / "ros2-session.md"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
# On a busy machine a node may be discovered late and be missing from a list: a person would look again.
LOOKS_AT_THE_GRAPH = re.compile(r"ros2 \w+ (list|info)\b")
LOOKS = 5
HERE = "here"  # in this window each line is waited for; in the others lines keep running

pytestmark = [
    pytest.mark.ros,
    pytest.mark.sandbox,
    pytest.mark.slow,  # the whole page is typed into a terminal
    pytest.mark.skipif(shutil.which("bwrap") is None, reason="needs a network of its own: apt-get install bubblewrap"),
]


@dataclass
class Step:
    """A line of the page and its output: to its end, or until Ctrl-C is pressed and after it."""

    window: str
    line: str  # "" for Ctrl-C in a window whose line is still running
    shown: list[str] = field(default_factory=list)


def blocks(page: str, language: str) -> list[tuple[str, str]]:
    """Return the code blocks of a language as pairs of the word after it and the text."""
    return re.findall(rf"^```{language}[ ]?(.*)\n((?:.*\n)*?)```$", page, re.MULTILINE)


def steps(page: str) -> list[Step]:
    """Return the lines that the page types."""
    found: list[Step] = []
    for window, text in blocks(page, "console"):
        for line in text.splitlines():
            if line.startswith("$ "):
                found.append(Step(window or HERE, line[2:]))
            elif line.startswith("^C") and window:
                found.append(Step(window, "", [line]))
            else:
                found[-1].shown.append(line)
    return found


def pattern(lines: list[str]) -> str:
    """Return a pattern for the lines with any numbers in them; … matches any text, alone in a line any lines.

    The terminal writes ^C where Ctrl-C is pressed, which may be in the middle of the output.
    """
    parts = []
    for line in lines:
        if line == "…" or line.startswith("^C"):
            parts.append(r"(?:.*\n)*?")
        if line.removeprefix("^C") in ("", "…") and line:
            continue
        pieces = line.removeprefix("^C").rstrip().split("…")
        words = [NUMBER.pattern.join(map(re.escape, NUMBER.split(piece))) for piece in pieces]
        parts.append(".*".join(words) + r"[ ]*\n")
    return "".join(parts)


def fits(shown: list[str], said: str) -> bool:
    """Return whether the output is as the page shows it."""
    said = said.replace("^C", "", 1)
    return re.fullmatch(pattern(shown), said if said.endswith("\n") or not said else said + "\n") is not None


def play(step: Step, terminal: Terminal) -> None:
    """Type a line and compare its output."""
    stop = next((i for i, line in enumerate(step.shown) if line.startswith("^C")), None)
    shown = step.shown
    if not step.line:
        said, shown = terminal.interrupt(), ["…", *shown]  # the earlier output is shown further up
    elif stop is not None:
        terminal.start(step.line)
        terminal.wait_for(r"\A" + pattern(shown[:stop]))
        said = terminal.interrupt()
    elif step.window != HERE:
        terminal.start(step.line)
        terminal.wait_for(r"\A" + pattern(shown))
        return
    else:
        said = terminal.run(step.line)
    for _ in range(LOOKS):
        if fits(shown, said) or not LOOKS_AT_THE_GRAPH.match(step.line):
            break
        said = terminal.run(step.line)
    assert fits(shown, said), f"$ {step.line}\n{said}\nis not as on the page:\n" + "\n".join(shown)
    assert "Traceback" not in said
    if step.line == "echo $?":
        assert said.split() == shown


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory, reference: Path) -> Iterator[Callable[[], Terminal]]:
    """Return a function that opens a terminal beside the built reference package."""
    folder = tmp_path_factory.mktemp("session")
    (folder / "robot.py").write_text(blocks(PAGE.read_text(), "python")[0][1])
    install = building.build([reference], building.cache_folder(), COURSE).install
    env = {**ros_env.environment(install, home=folder), **ros_env.ON_THIS_MACHINE, "TERM": "xterm"}
    with desk(folder, env) as open_one:
        yield open_one


def test_the_session_goes_as_on_the_page(window):
    """Topics, services, an action with feedback, parameters, a bag recorded and played; Ctrl-C; wrong input."""
    page = PAGE.read_text()
    opened: dict[str, Terminal] = {}
    for step in steps(page):
        if step.window == "build":  # done by the fixture and by the last test
            continue
        if step.window not in opened:
            opened[step.window] = window()
        play(step, opened[step.window])


@pytest.fixture(scope="module")
def beside_the_robot(window: Callable[[], Terminal]) -> Iterator[Terminal]:
    """Return a terminal beside a robot and its controller that run in others."""
    robot, nodes = window(), window()
    robot.start("python robot.py")
    nodes.start("ros2 run ros2_robot_controller robot_controller --ros-args -p use_sim_time:=true")
    nodes.wait_for("is ready")
    terminal = window()
    yield terminal
    for one in (nodes, robot):
        one.interrupt()


@pytest.mark.parametrize(
    ("line", "until", "code"),
    [
        ("ros2 topic pub -r 50 /chatter std_msgs/msg/String", "#3", 2),
        ("ros2 topic hz /nobody", "WARNING", 2),
        ("ros2 bag record -o early /odom", "Listening", 0),
    ],
)  # fmt: skip
def test_ctrl_c_ends_a_line(beside_the_robot, line, until, code):
    """With an exit code, and without a traceback."""
    beside_the_robot.start(line)
    beside_the_robot.wait_for(until)
    said = beside_the_robot.interrupt()
    assert "Traceback" not in said
    assert beside_the_robot.code == code


@pytest.mark.parametrize("shell", ["bash", needs_zsh("zsh")])
def test_a_prepared_terminal_builds(tmp_path, shell):
    """A plain `colcon build` of a package with interfaces finds the wheels, as after sourcing an installed ROS."""
    source = tmp_path / "src" / "greeter"
    (source / "msg").mkdir(parents=True)
    (source / "msg" / "Greeting.msg").write_text("string text\n")
    (source / "package.xml").write_text(TEXTS["PACKAGE"])
    (source / "CMakeLists.txt").write_text(TEXTS["CMAKE"])
    with desk(tmp_path, {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)}, shell) as open_one:
        terminal = open_one()
        terminal.run(f"source {COMMAND}/setup.bash")
        built = terminal.run("colcon build", limit_s=900)
        assert terminal.code == 0, built
        terminal.run(f"source install/setup.{shell}")
        assert terminal.run("ros2 interface package greeter") == "greeter/msg/Greeting\n"
        said = terminal.run("ros2 topic pub -1 -w 0 /hello greeter/msg/Greeting '{text: hi}'")
        assert "greeter.msg.Greeting(text='hi')" in said
