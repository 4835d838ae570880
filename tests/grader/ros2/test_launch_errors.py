"""An error is one message: the feature, the file and the line, and what to do instead."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers.ros2_runs import write

from grader.ros2.launching.errors import explain


def refusal(visitor: Any, file: Path) -> str:
    """Return the message with which a launch file is refused."""
    with pytest.raises(Exception) as raised:  # noqa: PT011 - any; its message is compared
        visitor.launch(file)
    return explain(raised.value)


@pytest.mark.parametrize(
    ("entity", "words"),
    [
        ("Node(package='mine', executable='x')", "\"package 'mine' not found, searching: ["),
        ("Node(package='demo', node_executable='show')", "since ROS 2 Galactic it is called 'executable'"),
        ("demo('show', name='a b')", "Invalid node name 'a b'"),
        ("demo('show', namespace='9')", "Invalid namespace '/9'"),
        ("DeclareLaunchArgument('r', description='Need.')", "missing required argument 'r' (description: 'Need.')"),
        ("demo('show', LaunchConfiguration('no'))", "launch configuration 'no' does not exist"),
        ("demo('show', EnvironmentVariable('NO_X'))", "environment variable 'NO_X' does not exist"),
        ("demo('show', Command('false'))", "executed command failed. Command: false"),
        ("demo('show', PythonExpression('1/0'))", "'1/0' fails: ZeroDivisionError"),
        ("*(lambda n: [n, n])(demo('show'))", "executed more than once"),
        ("demo('show', parameters=[{'a': []}])", "a list without items has no type"),
        ("IncludeLaunchDescription('/there.launch.py')", "No such file or directory: '/there.launch.py'"),
    ],
)
def test_an_impossible_entity_is_one_message(visitor, tmp_path, entity, words):
    assert words in refusal(visitor, write(tmp_path, entity))


@pytest.mark.parametrize(
    ("name", "kind"),
    [("a.launch.xml", "an XML"), ("b.launch", "an XML"), ("c.launch.yaml", "a YAML"), ("d_launch.yml", "a YAML")],
)
def test_an_xml_or_yaml_launch_file_is_refused_in_one_sentence(visitor, tmp_path, name, kind):
    file = tmp_path / name
    file.write_text("<launch/>")
    assert refusal(visitor, file).startswith(
        f"{name} is {kind} launch file, which this kit does not read: write it as a Python launch file (.launch.py) "
        "with generate_launch_description()."
    )


def test_a_refusal_names_the_line_that_includes_and_nothing_of_the_event_loop(launch, tmp_path):
    """An XML launch file was once refused with a line of asyncio."""
    (tmp_path / "a.launch.xml").write_text("<launch/>")
    run = launch(write(tmp_path, f"IncludeLaunchDescription('{tmp_path}/a.launch.xml')")).end()
    assert run.code == 1
    assert (
        "(its traceback is in launch.log): a.launch.xml is an XML launch file, which this kit does not read" in run.out
    )
    assert f" ({tmp_path}/made.launch.py, line 11)\n" in run.out
    assert "asyncio" not in run.out
    assert "Traceback" not in run.out + run.err


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            "from launch_ros.actions import ComposableNodeContainer\nComposableNodeContainer(name='c')",
            "line 2: ComposableNodeContainer of launch_ros.actions is not supported by the launch of this kit. Start",
        ),
        (
            "from launch.launch_description_sources import FrontendLaunchDescriptionSource as X\nX('a.xml')",
            "line 2: FrontendLaunchDescriptionSource of launch.launch_description_sources is not supported",
        ),
        (
            "from launch.actions import SetRemap, Nodes\nfrom launch_ros.actions import SetRemap\nSetRemap('a', 'b')",
            "line 3: SetRemap of launch_ros.actions is not supported by the launch of this kit. Write `remappings`",
        ),
        (
            "import launch\nlaunch.logging.launch_config.level = 10",
            "line 2: launch_config of launch.logging is not supported by the launch of this kit.",
        ),
        (
            "from launch.substitutions import ThisLaunchFile\nThisLaunchFile()",
            "line 2: ThisLaunchFile of launch.substitutions is not supported by the launch of this kit. Use __file__",
        ),
        ("import launch.actoins", "No module named 'launch.actoins'"),
        ("from nav2_common.launch import RewrittenYaml", "No module named 'nav2_common'"),
        (
            "from launch.actions import Nodes\nNodes()",
            "line 2: Nodes of launch.actions is not supported by the launch of",
        ),
        ("from launch.actions import Nodes\nNodes()", "this kit. Did you mean Node?"),
        ("def generate_launch_description(:", "SyntaxError"),
        ("x = 1", "does not contain the required function 'generate_launch_description()'"),
        ("def generate_launch_description(): pass", "returns NoneType, not a LaunchDescription"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_message(visitor, tmp_path, line, words):
    file = tmp_path / "made.launch.py"
    file.write_text(line + "\n")
    said = refusal(visitor, file)
    assert words in said
    assert "made.launch.py" in said


@pytest.mark.parametrize("wanted", ["false", "true"])
def test_a_container_is_refused_only_if_its_condition_holds(visitor, tmp_path, wanted):
    """A launch file with an option for composition was refused as a whole."""
    container = """ComposableNodeContainer(name='c', namespace='', package='rclcpp_components',
        executable='component_container', condition=IfCondition(LaunchConfiguration('composed')),
        composable_node_descriptions=[ComposableNode(package='p', plugin='p::Node')])"""
    file = tmp_path / "made.launch.py"
    file.write_text(f"""from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer
from launch_ros.descriptions import ComposableNode


def generate_launch_description():
    return LaunchDescription([DeclareLaunchArgument('composed', default_value='{wanted}'),
        {container}, LogInfo(msg='all is read')])
""")
    if wanted == "true":
        assert "ComposableNodeContainer of launch_ros.actions is not supported" in refusal(visitor, file)
    else:
        visitor.launch(file)
        assert visitor.said == ["all is read"]


@pytest.mark.slow  # a start for each line
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere", "x.launch.py"], "Package 'nowhere' not found: \"package 'nowhere' not found, searching: ["),
        (
            ["demo", "x.launch.py"],
            "file 'x.launch.py' was not found in the share directory of package 'demo' which is at",
        ),
        (["demo", "one.launch.py", "rate:="], "malformed launch argument 'rate:=', expected format '<name>:=<value>'"),
        (["demo", "one.launch.py", "rate=1"], "malformed launch argument 'rate=1', expected format '<name>:=<value>'"),
        (["demo"], "'demo' is not a file: ros2 launch takes a package and the name of its launch file, or a path"),
    ],
)
def test_a_wrong_command_line_is_one_message(ros2, words, said):
    done = ros2("launch", *words)
    assert (done.returncode, done.stdout) == (1, "")
    assert said in done.stderr


def test_a_lifecycle_node_is_started_as_a_plain_one_with_a_warning(visitor, tmp_path):
    node = "LifecycleNode(package='demo', executable='show', name='n', namespace='')"
    assert visitor.launch(write(tmp_path, node)) == ["show --ros-args -r __node:=n -r __ns:=/"]
    assert "a LifecycleNode is started as a plain node" in visitor.said[0]


def test_show_args_describes_the_defaults(ros2, tmp_path):
    """They are not evaluated: only `generate_launch_description` runs."""
    file = write(
        tmp_path,
        "DeclareLaunchArgument('a', default_value=['x', LaunchConfiguration('b'), EnvironmentVariable('NOT_SET')])",
        "DeclareLaunchArgument('b', description='Needed.', choices=['1', '2'])",
        "GroupAction([DeclareLaunchArgument('c', default_value='')], condition=IfCondition('true'))",
    )
    shown = ros2("launch", "-s", file)
    assert shown.stdout == (
        "Arguments (pass arguments as '<name>:=<value>'):\n"
        "\n    'a':\n        no description given\n        (default: 'x' + LaunchConfig('b') + EnvVar('NOT_SET'))\n"
        "\n    'b':\n        Needed. Valid choices are: ['1', '2']\n"
        "\n    'c':*\n        no description given\n        (default: '')\n"
        "\n* argument(s) which are only used if specific conditions occur\n"
    )
    assert shown.returncode == 0
    file.write_text("from launch import LaunchDescription\ngenerate_launch_description = LaunchDescription\n")
    assert ros2("launch", "--show-args", file).stdout.endswith("\n  No arguments.\n")


def test_a_node_of_a_package_that_cannot_be_had_here_does_not_keep_the_others_from_starting(visitor, tmp_path):
    """Real launch files start rviz2 or a static transform beside their own nodes; all of them ended with an error."""
    file = write(tmp_path, "Node(package='rviz2', executable='rviz2')", "demo('show', 'here')")
    assert visitor.launch(file) == ["show here --ros-args"]
    assert "this node is not started: rviz2 cannot be installed with pip; look at the robot with" in visitor.said[0]
