"""The names that launch files of students use, as counted in 533 of 79 repositories, and what each means."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest
from helpers.ros2_runs import COMMAND

from grader import KIT
from grader.ros2.launching import modules

# Places of the real ones from which launch files were seen to import, besides the modules of the table.
ALSO = [
    ("launch.substitutions.path_join_substitution", "PathJoinSubstitution"),
    ("launch_ros.actions.node", "Node"),
    ("launch.launch_description_sources.python_launch_description_source", "PythonLaunchDescriptionSource"),
    ("launch.actions.shutdown_action", "Shutdown"),
    ("launch.events.process.process_exited", "ProcessExited"),
    ("launch_ros.substitutions.find_package", "FindPackageShare"),
]


def test_the_page_lists_the_names_of_the_table():
    """As `Name`, a method as `.name()`. Types for annotations, errors and events are not listed."""
    page = (KIT / "docs/launch.md").read_text()
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    shown = {name for row in rows for name in re.findall(r"`([A-Z]\w+)`", row)}
    table = modules.table()
    listed = ("actions", "conditions", "substitutions", "handlers", "sources", "descriptions")
    named = {name for module, names in table.items() if module.endswith(listed) for name in names}
    plain = {name for name in named if not name.startswith("Invalid") and name not in ("SubstitutionFailure",)}
    assert plain - shown == {"evaluate_condition_expression", "PushROSNamespace", "ComposableNode"}
    assert shown - plain == {"LaunchDescription"}


def test_each_name_is_at_its_real_place_and_only_where_a_launch_file_runs():
    """Elsewhere `launch` cannot be imported. An unrelated module of that name, as on PyPI, is not taken for it."""
    rows = [(module, name) for module, names in modules.table().items() for name in names] + ALSO
    code = f"""
import importlib, sys, types
sys.path.insert(0, {str(COMMAND.parents[1])!r})
try:
    import launch
except ImportError:
    pass
else:
    assert not hasattr(launch, "LaunchDescription")
sys.modules["launch"] = types.ModuleType("launch")
from grader import KIT
from grader.ros2.launching import modules
modules.install()
for module, name in {rows!r}:
    found = getattr(importlib.import_module(module), name)
    assert type(found).__name__ != "_Refusing"
import launch, launch.actions, launch_ros.actions
assert launch.actions.ExecuteProcess and launch_ros.actions.Node
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def show(visitor: Any, *words: Any, **rest: Any) -> Any:
    return visitor.Node(package="demo", executable="show", arguments=list(words), **rest)


def test_the_index_knows_a_sourced_package(visitor, demo):
    from ament_index_python.packages import get_package_prefix, get_package_share_path

    assert get_package_prefix("demo") == str(demo)
    assert get_package_share_path("demo") == demo / "share/demo"


def test_a_default_is_set_only_where_there_is_no_value(visitor):
    first, second = (visitor.DeclareLaunchArgument("x", default_value=value) for value in ("1", "2"))
    x = visitor.LaunchConfiguration("x")
    assert visitor.visit(first, second, show(visitor, x)) == ["show 1 --ros-args"]
    with pytest.raises(RuntimeError, match="Required launch argument 'y'"):
        visitor.visit(visitor.DeclareLaunchArgument("y"))


def test_a_configuration_is_read_when_the_action_runs(visitor):
    x = visitor.LaunchConfiguration("x", default="none")
    lines = visitor.visit(
        show(visitor, x),
        visitor.SetLaunchConfiguration("x", "1"),
        show(visitor, x),
        visitor.SetLaunchConfiguration(name="x", value=[x, "2"]),
        show(visitor, [x, "!"]),
    )
    assert lines == ["show none --ros-args", "show 1 --ros-args", "show 12! --ros-args"]


@pytest.mark.parametrize(
    ("text", "value"), [("true", True), (" True ", True), ("1", True), ("FALSE", False), ("0", False)]
)
def test_a_condition_is_true_false_1_or_0(visitor, text, value):
    assert visitor.IfCondition(text).evaluate(visitor.context) is value
    assert visitor.UnlessCondition([text]).evaluate(visitor.context) is not value
    for wrong in ("yes", "", "2"):
        with pytest.raises(RuntimeError, match="invalid condition expression"):
            visitor.IfCondition(wrong).evaluate(visitor.context)


def test_find_package_share_gives_the_share_folder(visitor, demo):
    share = visitor.FindPackageShare("demo")
    assert (visitor.text(share), share.find("demo")) == (f"{demo}/share/demo",) * 2
    assert visitor.text(visitor.ExecutableInPackage("show", "demo")) == f"{demo}/lib/demo/show"
    with pytest.raises(RuntimeError, match="executable 'ls' not found on the libexec directory"):
        visitor.text(visitor.ExecutableInPackage(executable="ls", package="demo"))


def test_parts_are_joined(visitor):
    visitor.context.launch_configurations["x"] = "b"
    parts = ["a", visitor.LaunchConfiguration("x"), visitor.TextSubstitution(text="c.yaml")]
    assert visitor.text(visitor.PathJoinSubstitution(parts)) == "a/b/c.yaml"
    with pytest.raises(TypeError):
        visitor.TextSubstitution(text=5)


def test_a_command_gives_its_output(visitor):
    assert visitor.text(visitor.Command(["echo ", "'a b' c"])) == "a b c\n"
    with pytest.raises(RuntimeError, match="showed stderr output"):
        visitor.text(visitor.Command("sh -c 'echo oh >&2'"))
    assert visitor.text(visitor.Command("sh -c 'echo oh >&2; echo x'", on_stderr="ignore")) == "x\n"


def test_parameter_values_get_their_types(visitor):
    """A plain text stays text; the text of a substitution is read as YAML, unless a type is given."""
    config = visitor.LaunchConfiguration
    visitor.context.launch_configurations |= {"int": "0x10", "list": "[1, 2]", "on": "on", "empty": "", "float": "1e3"}
    found = visitor.parameters(
        {
            "text": "1",
            "int": config("int"),
            "on": config("on"),
            "list": config("list"),
            "empty": config("empty"),
            "float": config("float"),
            "joined": [config("int"), "x"],
            "words": ["a", "1"],
            "floats": (1, 2.5),
            "deep": {"er": {"still": True}},
            "said": visitor.ParameterValue(config("int"), value_type=str),
            "number": visitor.ParameterValue(config("float"), value_type=float),
        },
        name="n",
    )
    assert found == {
        "text": "1",
        "int": 16,
        "on": True,
        "list": [1, 2],
        "empty": "",
        "float": "1e3",
        "joined": "0x10x",
        "words": ["a", "1"],
        "floats": [1.0, 2.5],
        "deep.er.still": True,
        "said": "0x10",
        "number": 1000.0,
    }
    assert visitor.key == "/**", "the node's full name is known only with its namespace"
    visitor.parameters({"a": 1}, name="n", namespace="ns")
    assert visitor.key == "/ns/n"
    for wrong in ("{a: 1}", "[1, a]", "[]", "~", "2024-01-01"):
        with pytest.raises(TypeError):
            visitor.parameters({"x": config("wrong", default=wrong)})
    with pytest.raises(TypeError, match="Unable to parse"):
        visitor.parameters({"x": config("wrong", default="a: b: c")})


def test_an_expression_can_use_math(visitor):
    visitor.context.launch_configurations["x"] = "4"
    x = visitor.LaunchConfiguration("x")
    assert visitor.text(visitor.PythonExpression(["int(sqrt(", x, ")) + math.floor(2.5)"])) == "4"
    assert visitor.text(visitor.PythonExpression(["'", x, "' == '4'"])) == "True"
    assert visitor.text(visitor.PythonExpression("os.sep", ["os"])) == "/"


def test_environment_variables_are_read_and_set(visitor):
    name = visitor.EnvironmentVariable("DEMO_ENV", default_value="none")
    visitor.visit(show(visitor, name), visitor.SetEnvironmentVariable("DEMO_ENV", "set"), show(visitor, name))
    assert [one.process_details["cmd"][1] for one in visitor.started] == ["none", "set"]
    assert visitor.started[1].process_details["env"]["DEMO_ENV"] == "set"
    assert "DEMO_ENV" not in visitor.started[0].process_details["env"]
    with pytest.raises(RuntimeError, match="environment variable 'NOT_THERE' does not exist"):
        visitor.text(visitor.EnvironmentVariable("NOT_THERE"))


def test_what_a_group_adds_to_earlier_settings_holds_after_it(visitor):
    """A quirk of the real one: a group restores which list of settings there is, not what is in it."""
    setting = visitor.SetParameter
    lines = visitor.visit(
        visitor.GroupAction([setting("a", 1)]),
        show(visitor),
        *(setting("c", 2), visitor.GroupAction([setting("d", 3)])),
        show(visitor),
    )
    assert lines == ["show --ros-args", "show --ros-args -p c:=2 -p d:=3"]


def test_a_list_set_for_all_nodes_becomes_text(visitor):
    """A quirk of the real one: no node reads round brackets as a list."""
    lines = visitor.visit(visitor.SetParameter("a", [1, 2]), visitor.SetParameter(name="b", value="x y"), show(visitor))
    assert lines == ["show --ros-args -p a:=(1, 2) -p b:=x y"]


def test_what_only_changes_how_output_looks_is_accepted_and_a_prefix_comes_first(visitor):
    node = show(visitor, prefix="nice -n 5", sigterm_timeout="1", log_cmd=True, output={"both": "screen"})
    (line,) = visitor.visit(node)
    assert line.startswith("nice -n 5 show")


def test_the_keywords_of_a_node_are_those_of_the_real_one(visitor):
    on_exit: Callable[..., None] = lambda *_: None  # noqa: E731 - as a launch file has it
    node = visitor.Node(
        package="demo", executable="show", name="n", namespace="ns", output="screen",
        parameters=[{"a": 1}], arguments=["x"], remappings=[("a", "b")], condition=visitor.IfCondition("1"),
        emulate_tty=True, respawn=True, respawn_delay=2.0, respawn_max_retries=3, on_exit=on_exit,
        exec_name="label", ros_arguments=["--log-level", "info"], additional_env={"A": "b"}, cwd="/", shell=False,
    )  # fmt: skip
    (line,) = visitor.visit(node)
    assert line == (
        "show x --ros-args --log-level info --ros-args -r __node:=n -r __ns:=/ns --params-file DICT -r a:=b"
    )
    assert node.process_details["name"] == "label-1"
    assert node.process_details["env"]["A"] == "b"


@pytest.mark.parametrize(
    ("left", "right", "equal"),
    [("TRUE", "1", True), ("1.0", "1", True), ("a", "A", False), (0, 0.0, True), ("", None, True)],
)
def test_texts_are_compared_as_truths_numbers_and_letters(visitor, left: Any, right: Any, equal: bool):
    assert visitor.text(visitor.EqualsSubstitution(left, right)) == str(equal).lower()
    assert visitor.text(visitor.NotEqualsSubstitution(left, right)) == str(not equal).lower()


def test_truth_values_are_combined(visitor):
    assert visitor.text(visitor.AndSubstitution("true", "0")) == visitor.text(visitor.NotSubstitution("1")) == "false"
    assert visitor.text(visitor.OrSubstitution("true", "0")) == "true"


def test_the_folder_of_the_launch_file_is_found(visitor):
    file = KIT / "tests/grader/ros2/launch_files/plain_list.launch.py"
    visitor.launch(file)
    assert visitor.text(visitor.ThisLaunchFileDir()) == str(file.parent)


def test_a_condition_on_another_value_holds_without_one(visitor):
    def other() -> Any:
        return show(visitor, "other", condition=visitor.LaunchConfigurationNotEquals("robot", "tb4"))

    assert len(visitor.visit(other(), visitor.SetLaunchConfiguration("robot", "tb4"))) == 1
    assert len(visitor.visit(other())) == 1, "no further one"
