"""Q5: the README's words, and its table compared with the running nodes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers import beside
from helpers.course import COURSE
from helpers.quality_examples import REFERENCE, Judged, facts, judged, untouched, written

from grader import evidence
from grader.checks.check_readme import test_interface_table_agrees as table
from grader.checks.check_readme import test_readme_says_what_and_how as words
from grader.quality.readme import read_readme
from grader.quality.source import hidden_flags

TEXTS = beside(__file__)

TRUE = (REFERENCE / "README.md").read_text()
OF_EVERY_NODE = {"rosout": "rcl_interfaces/msg/Log", "parameter_events": "rcl_interfaces/msg/ParameterEvent"}
CLOCK_TYPE = {"clock": "rosgraph_msgs/msg/Clock"}


def running() -> dict[str, evidence.Trial]:
    """Return the idle trials with the graph that the reference shows."""
    trials = {}
    for node in COURSE.nodes.values():
        seen = {"publisher": {**node.publishes, **OF_EVERY_NODE}, "subscription": {**node.subscribes, **CLOCK_TYPE}}
        ends = [
            evidence.Endpoint(topic, kind, node.name, COURSE.full_type(type_), "reliable")
            for kind, topics in seen.items()
            for topic, type_ in topics.items()
        ]
        services, actions = (
            {name: [COURSE.full_type(type_)] for name, type_ in offers.items()}
            for offers in (node.services, node.actions)
        )
        graph = evidence.Graph([node.name], ends, services, actions)
        name = f"idle_{node.name}"
        trials[name] = evidence.Trial(name, node.name, "open_field", 0, True, "lockstep", None, graph=graph)
    return trials


def with_readme(tmp_path: Path, text: str | bytes | None) -> evidence.Quality:
    package = written(tmp_path / "p", {"README.md": text or "", "package.xml": ""})
    if text is None:
        (package / "README.md").unlink()
    return replace(
        untouched(),
        readme=read_readme(package, facts(package).paths, {REFERENCE.name}),
        paths=facts(package).paths,
    )


def said(tmp_path: Path, text: str) -> Judged:
    return judged(words, with_readme(tmp_path, text))


def compared(tmp_path: Path, text: str, **more: object) -> Judged:
    return judged(table, with_readme(tmp_path, text), **{"trials": running(), **more})


# -- words ------------------------------------------------------------------------------------------------------------


def test_a_missing_readme_gets_nothing(tmp_path: Path):
    result = judged(words, with_readme(tmp_path, None))
    assert result.share == 0.0
    assert judged(table, with_readme(tmp_path / "again", None)).reached is False


def test_a_readme_of_another_kind_is_pointed_out(tmp_path: Path):
    package = written(tmp_path, {"README.docx": b"PK\3\4", "package.xml": ""})
    assert "found README.docx" in judged(words, facts(package)).seen


DOES = "Drives a TurtleBot 4 safely."
NO_PROSE = (
    "# Title of this\n```\n" + "echo many many words in a block of code\n" * 20 + "```\n| a | b |\n|---|---|\n"
    + "| many words in a table | and more |\n" * 20
)  # fmt: skip


@pytest.mark.parametrize(
    ("text", "share", "words"),
    [
        ("# ros2_robot_controller\n", 0.0, "how to test it"),
        (NO_PROSE, 0.0, "what it does (0 words of prose"),
        (TRUE.replace(DOES, "TODO: describe the package."), 0.75, "TODO: describe the package"),
        (TRUE.replace(DOES, f"{DOES}\n<!-- TODO: say more -->\n"), 1.0, ""),
    ],
    ids=["a title alone", "code, headings and tables", "a placeholder", "a template's comment"],
)
def test_a_readme_says_what_the_package_does_in_prose(tmp_path: Path, text: str, share: float, words: str):
    result = said(tmp_path, text)
    assert result.share == share
    assert words in result.seen


@pytest.mark.parametrize(
    "text",
    [
        TRUE,
        TRUE.replace("    colcon build", "```bash\ncolcon build").replace("    source install", "source install"),
        TRUE.replace("python3 -m pytest test", "colcon test --packages-select ros2_robot_controller"),
        TRUE.replace("\n", "\r\n"),
        TRUE.replace("ros2 launch", "ros2 run"),
    ],
    ids=["the reference's", "fenced", "colcon test", "CRLF", "ros2 run"],
)
def test_other_ways_to_give_the_commands_lose_nothing(tmp_path: Path, text: str):
    assert said(tmp_path, text).share == 1.0


@pytest.mark.slow  # reads megabytes
@pytest.mark.parametrize(
    "text", [b"\xff\xfe\0\0", b"|" * 100_000, b"|-" * 100_000, b"| a |\n|---|\n" * 2000, b"\0" * 1000, b"[" * 30_000]
)
def test_hostile_markdown_is_read_in_finite_time(tmp_path: Path, text: bytes):
    quality = with_readme(tmp_path, text)
    assert judged(words, quality).share < 1
    assert judged(table, quality, trials=running()).share == 0.0


# -- what a reader sees ---------------------------------------------------------------------------------------------

COMMANDS = "colcon build\nros2 run ros2_robot_controller robot_controller\npytest test\n"


def shows(tmp_path: Path, text: str) -> set[str]:
    readme = with_readme(tmp_path, text).readme
    assert readme is not None
    return set(readme.shows)


@pytest.mark.parametrize(
    "hidden",
    [
        "<!-- {} -->",
        "<!--\n```\n{}\n```\n-->",
        "<!-- never closed\n{}",
        "<div hidden>\n\n{}\n\n</div>",
        "<div hidden>\n\n```\n{}\n```\n\n</div>",
        "<p style='display:none'><b>{}</b></p>",
        '<font color="#ffffff">{}</font>',
        '<div class="invisible">{}</div>',
        "<div\nhidden>{}</div>",
        "<div hidden/>{}",
        "<div hidden><div></div>{}</div>",
        "<template>{}</template>",
        "<script>\n{}\n</script>",
        '<img src="a.png" alt="{}">',
        '<p title="{}">Hello.</p>',
        "![{}](picture.png)",
        '[Hello](http://a.b "{}")',
        '[//]: # "{}"',
        "```{}",
        "<?php {} ?>",
    ],
)
def test_text_that_no_reader_sees_shows_nothing(tmp_path: Path, hidden: str):
    commands = COMMANDS.strip()
    text = hidden.format(commands if "\n" in hidden else commands.replace("\n", "; "))
    assert shows(tmp_path, f"# Package\n\n{text}\n") == set()


def test_a_hidden_table_and_hidden_prose_earn_nothing(tmp_path: Path):
    text = f"# Package\n\n<div hidden>\n\n{TRUE}\n\n</div>\n"
    assert said(tmp_path / "words", text).share == 0.0
    result = compared(tmp_path / "table", text)
    assert result.share == 0.0
    assert "words do not count: they are in comments, or in HTML" in result.seen


@pytest.mark.parametrize(
    "shown",
    [
        "{}",
        "```\n{}```",
        "~~~~bash\n```\n{}~~~~",
        "    <!-- in a block of code -->\n\n```\n{}\n<!-- as it is\n```",
        "`<!--` begins a comment.\n\n{}",
        "<details>\n<summary>How</summary>\n\n{}\n</details>",
        "<!-- gone --> {}",
        "<!-- gone\n--> {}",
        '<p align="center">{}</p>',
        "<table>\n<tr><td width='40%'>\n\n{}\n</table>",
        "one<br>two<br/>\n\n{}",
        "Go to <path to your folder>.\n\n{}",
        "<name of the package>\n\n{}",
        "<details open><summary>More</summary>{}",
        "<p hidden>gone</p>\n\n{}",
        "[![Build](https://a.b/c.svg)](https://a.b)\n\n{}",
        "[^1]: {}",
        "1 < 2, 3 <!- 4\n\n{}",
        "1. First\n\n    {}",
    ],
)
def test_text_that_a_reader_sees_counts(tmp_path: Path, shown: str):
    assert shows(tmp_path, f"# Package\n\n{shown.format(COMMANDS)}\n") == {"build", "run", "test"}


def test_honest_html_hides_nothing(tmp_path: Path):
    quality = with_readme(tmp_path, TEXTS["OTHERS"])
    assert judged(words, quality).share == 1.0
    assert quality.readme is not None
    assert quality.readme.tables == [
        evidence.Table(["node", "kind", "name", "type"], [["robot_controller", "subscribes", "scan", "LaserScan"]])
    ]
    assert hidden_flags(quality) == []


def test_much_text_that_no_reader_sees_is_a_flag(tmp_path: Path):
    (flag,) = hidden_flags(with_readme(tmp_path, f"# Package\n\n<!--\n{TRUE}\n-->\n"))
    assert (flag.kind, flag.where, flag.concerns) == ("hidden text", "README.md", ["readme"])


@pytest.mark.parametrize(
    ("command", "runs"),
    [
        ("ros2 launch turtlebot3_gazebo world.launch.py", False),
        ("ros2 run turtlesim turtlesim_node", False),
        ("ros2 launch ros2_robot_controller robot_controller_launch.py", True),
        ("ros2 launch -d ros2_robot_controller robot_controller_launch.py", True),
        ("ros2 launch launch/robot_controller_launch.py", True),
        ("ros2 run $PACKAGE robot_controller", True),
    ],
)
def test_a_command_for_another_package_does_not_run_this_one(tmp_path: Path, command: str, runs: bool):
    """A vendor's README is no README of this package."""
    assert ("run" in shows(tmp_path, f"# Package\n\n    {command}\n")) is runs


# -- the table --------------------------------------------------------------------------------------------------------


UNDER = "| `sensor_processor` | publishes | `obstacle_distance` |"
BEFORE = "| `sensor_processor` | publishes | `sensor_fusion_data` |"
STALE = "| `sensor_processor` | publishes | `camera/depth` | `sensor_msgs/msg/Image` | |\n"


@pytest.mark.parametrize(
    ("old", "new", "share", "said"),
    [
        ("`imu/data`", "`imu`", 9 / 11, "imu/data (Imu) is not in a table"),
        ("`std_msgs/msg/Float32`", "`std_msgs/msg/Float64`", 10 / 11,
         "obstacle_distance (Float32) is listed with another type"),
        ("publishes | `cmd_vel`", "subscribes | `cmd_vel`", 10 / 11,
         "cmd_vel (Twist) is listed with another direction"),
        ("srv/SetSpeed`", "srv/SetVelocity`", 10 / 11, "set_speed (SetSpeed) is listed with another type"),
        ("ros2_robot_controller/srv/SetSpeed`", "std_srvs/srv/Trigger`", 10 / 11,
         "set_speed (SetSpeed) is listed with another"),
        (UNDER, UNDER.replace("sensor_processor", "robot_controller"), 10 / 11,
         "sensor_processor: publisher obstacle_distance (Float32) is listed under another node"),
        (BEFORE, STALE + BEFORE, 10 / 11,
         "no node has the interface of this row: sensor_processor | publishes | camera/depth"),
    ],
)  # fmt: skip
def test_one_wrong_row_costs_its_share(tmp_path: Path, old: str, new: str, share: float, said: str):
    result = compared(tmp_path, TRUE.replace(f"| {old}", f"| {new}").replace(old, new))
    assert result.share == pytest.approx(share)
    assert said in result.seen


CONTRACTS = """\
| node | subscribes | publishes | services / action |
|---|---|---|---|
| `robot_controller` | `/scan` sensor_msgs/LaserScan, `/odom` nav_msgs/Odometry | `/cmd_vel` geometry_msgs/Twist | `set_speed` (SetSpeed), `get_status` (GetRobotStatus), action `navigate_to_position` (NavigateToPosition) |
| `sensor_processor` | raw_scan LaserScan<br>imu/data Imu<br>battery/state BatteryState | sensor_fusion_data SensorFusionData, obstacle_distance std_msgs/Float32 | |
"""  # noqa: E501
BARE = CONTRACTS.replace(" (SetSpeed)", "").replace(" (GetRobotStatus)", "").replace(" (NavigateToPosition)", "")
MORE = """
| Definition | Fields |
|---|---|
| `srv/SetSpeed` | float32 speed -> bool success, string message |
| `ros2_robot_controller/msg/SensorFusionData` | std_msgs/Header header, float32 battery_level |
"""
NEXT = "| `sensor_processor` |"
CLOCK = "| `robot_controller` | subscribes | `/clock` | `rosgraph_msgs/msg/Clock` | |\n"


@pytest.mark.parametrize(
    "text",
    [TRUE, CONTRACTS, TEXTS["SEVERAL"], BARE, TRUE + MORE, TEXTS["ENDS"], TRUE.replace(NEXT, CLOCK + NEXT, 1)],
    ids=["own", "like the contract's", "for each kind", "services without types", "of fields", "both ends", "clock"],
)
def test_tables_of_other_shapes_agree(tmp_path: Path, text: str):
    result = compared(tmp_path, text)
    assert result.share == 1.0, result.seen


def test_columns_under_the_wrong_direction_cost_most(tmp_path: Path):
    swapped = CONTRACTS.replace("| node | subscribes | publishes |", "| node | publishes | subscribes |")
    assert compared(tmp_path, swapped).share < 0.4


def test_a_topic_beyond_the_contract_needs_a_row(tmp_path: Path):
    trials = running()
    graph = trials["idle_robot_controller"].graph
    assert graph is not None
    extra = evidence.Endpoint("path", "publisher", "robot_controller", "nav_msgs/msg/Path", "reliable")
    trials["idle_robot_controller"] = replace(
        trials["idle_robot_controller"], graph=replace(graph, endpoints=[*graph.endpoints, extra])
    )
    assert "path (Path) is not in a table" in compared(tmp_path, TRUE, trials=trials).seen
    row = "| `robot_controller` | publishes | `path` | `nav_msgs/msg/Path` | |\n"
    assert compared(tmp_path, TRUE.replace(NEXT, row + NEXT, 1), trials=trials).share == 1.0


def test_nodes_that_do_not_run_are_compared_by_their_code(tmp_path: Path):
    """The README is not blamed for nodes that do not come up."""
    assert compared(tmp_path, TRUE, trials={}).share == 1.0
    result = compared(tmp_path, TRUE.replace("`cmd_vel`", "`velocity`"), trials={})
    assert result.share < 1
    assert "compared with the code" in result.seen


def test_a_package_without_code_has_nothing_to_agree_with(tmp_path: Path):
    quality = replace(with_readme(tmp_path, TRUE), interfaces=[])
    assert judged(table, quality, trials={}).share == 0.0
