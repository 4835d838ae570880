"""What the real launch refuses is refused here, in its words, so that nobody finds out on the robot.

The errors were those of launch 3.4.3 and launch_ros 0.26.6 on 22 November 2026.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from grader.ros2.launching import modules
from grader.ros2.launching.entities import LaunchContext

NOT_NORMAL = "Failed to normalize given item of type '<class '{}'>', when only 'str' or 'launch.Substitution' were"
NOT_BOOL = "value='{}' is not an instance of <class 'bool'>"


@pytest.fixture
def names() -> dict[str, Any]:
    """Return what a launch file imports."""
    found: dict[str, Any] = {"Path": Path, "context": LaunchContext(), "List": list}
    for module, there in modules.table().items():
        found |= {} if module.startswith("launch.events") else there
    return found


@pytest.mark.parametrize(
    ("code", "error", "text"),
    [
        ("TimerAction(period=1, actions=[])", TypeError, "<class 'float'>], but got '1' of type '<class 'int'>'"),
        ("TimerAction(period=1.0, actions=LogInfo(msg='x'))", TypeError, "'LogInfo' object is not iterable"),
        # remappings
        ("Node(executable='a', remappings=[['a', 'b']])", TypeError, "one of [<class 'tuple'>], but got '['a', 'b']'"),
        ("Node(executable='a', remappings=['a:=b'])", TypeError, "[<class 'tuple'>], but got 'a:=b' of type '<class"),
        ("Node(executable='a', remappings={'a': 'b'})", TypeError, "'remap_rule' to be one of [<class 'tuple'>], but"),
        ("Node(executable='a', remappings=[('a',)])", TypeError, "remap_rule must be a tuple of length 2, got length"),
        # settings
        ("Node(executable='a', respawn='true')", TypeError, NOT_BOOL.format("true")),
        ("Node(executable='a', output=True)", TypeError, "'bool' object is not iterable"),
        ("Node(executable='a', cwd=Path('/'))", TypeError, "'PosixPath' object is not iterable"),
        ("Node(executable='a', ros_arguments=('b',))", TypeError, 'can only concatenate list (not "tuple") to list'),
        ("Node(executable='a', name='n', autostart=True)", TypeError, "unexpected keyword argument 'autostart'"),
        # paths, numbers and lists in place of texts
        ("Node(executable='a', arguments=[5])", TypeError, "'int' object is not iterable"),
        ("Node(executable='a', arguments=[['b', ['c']]])", TypeError, NOT_NORMAL.format("list")),
        ("Node(executable='a', arguments=LaunchConfiguration('b'))", TypeError, "Configuration' object is not iterab"),
        ("ExecuteProcess(cmd=['ls', Path('/')])", TypeError, "'PosixPath' object is not iterable"),
        ("DeclareLaunchArgument('a', default_value=5)", TypeError, "'int' object is not iterable"),
        ("DeclareLaunchArgument('a', choices=[])", RuntimeError, "Provided choices arg is empty. Use None to"),
        ("DeclareLaunchArgument('a', choices=['b'], default_value='c')", RuntimeError, '"c" is not in provided'),
        ("LogInfo(msg=['a', 5])", TypeError, NOT_NORMAL.format("int")),
        ("PythonLaunchDescriptionSource(Path('/x'))", TypeError, "'PosixPath' object is not iterable"),
        ("PathJoinSubstitution(['a', ['b', '.yaml']])", TypeError, NOT_NORMAL.format("list")),
        ("PathJoinSubstitution(['a']) / 'b'", TypeError, "unsupported operand type(s) for /: 'PathJoinSubstitution'"),
        ("FindPackageShare('a') / 'b'", TypeError, "unsupported operand type(s) for /: 'FindPackageShare' and 'str'"),
        ("IfCondition(True)", TypeError, "'bool' object is not iterable"),
        ("IfCondition('yes').evaluate(context)", RuntimeError, "expected one of [true, 1, false, 0] but got 'yes'"),
        # events
        ("OnProcessExit()", TypeError, "missing 1 required keyword-only argument: 'on_exit'"),
        ("OnProcessExit(on_exit=[5])", TypeError, "to be of type 'LaunchDescriptionEntity' but got '<class 'int'>'"),
        ("OnProcessStart(target_action=LogInfo(msg=''), on_start=[])", TypeError, "action_matcher must be an 'Execute"),
        ("EmitEvent(event=5)", RuntimeError, "EmitEvent() expected an event instance, got '5'."),
        # parameters
        ("Node(executable='a', parameters='b')", TypeError, "expected 'parameters' to be one of [<class 'list'>], bu"),
        ("Node(executable='a', parameters=[5])", TypeError, "'ParameterFile()' expected 'param_file' to be one of"),
        ("Node(executable='a', parameters=[[{'b': 1}]])", TypeError, NOT_NORMAL.format("dict")),
        ("Node(executable='a', parameters=[{'b': None}])", TypeError, "Unexpected type for parameter value None"),
        ("Node(executable='a', parameters=[{'b': Path('/')}])", TypeError, "for parameter value PosixPath('/')"),
        ("Node(executable='a', parameters=[{5: 1}])", TypeError, "'int' object is not iterable"),
        ("SetParameter('a', None)", TypeError, "Unexpected type for parameter value None"),
        ("ParameterValue('5', value_type=int)", TypeError, "value='5' is not an instance of <class 'int'>"),
        ("ParameterValue(5, value_type=float)", TypeError, "value='5' is not an instance of <class 'float'>"),
        ("ParameterValue([1, 'b'])", TypeError, "Input value is not an acceptable 'SomeValueType'.Got value='[1, 'b'"),
        ("ParameterValue([1], value_type=List[str])", TypeError, "Got a list of '<class 'int'>', expected a list of"),
    ],
)  # fmt: skip
def test_what_the_real_one_refuses_is_refused(names, code, error, text):
    with pytest.raises(error) as raised:
        eval(code, names)
    assert text in str(raised.value)


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("LaunchConfiguration('x', default=['a', 1])", "a1"),
        ("LaunchConfiguration('x', default=5)", "5"),
        ("LaunchConfiguration('x', default=Path('/a/b'))", "/a/b"),
        ("LaunchConfiguration('x', default=[['a', 'b'], 'c'])", "['a', 'b']c"),
        ("LaunchConfiguration('x', default=[])", ""),
    ],
)
def test_odd_values_give_the_text_of_the_real_one(names, code, text):
    assert eval(code, names).perform(names["context"]) == text


@pytest.mark.parametrize(
    ("code", "value"),
    [
        ("ParameterValue(LaunchConfiguration('x', default='1'), value_type=bool)", True),
        ("ParameterValue(LaunchConfiguration('x', default='1'), value_type=float)", 1.0),
        ("ParameterValue(LaunchConfiguration('x', default='[1, 2]'), value_type=List[int])", [1, 2]),
        ("ParameterValue([LaunchConfiguration('x', default='a'), 'b'], value_type=str)", "ab"),
        ("ParameterValue([[LaunchConfiguration('x', default='a')], 'b'], value_type=List[str])", ["a", "b"]),
        ("ParameterValue([1, 2.5])", [1.0, 2.5]),
    ],
)
def test_a_value_of_a_given_type_is_read_as_the_real_one_reads_it(names, code, value):
    found = eval(code, names).evaluate(names["context"])
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("text", "kind", "said"),
    [
        ("1.5", "int", "invalid literal for int() with base 10: '1.5'"),
        ("maybe", "bool", "Cannot convert value 'maybe' to '<class 'bool'>'"),
        ("[1, 2]", "List[float]", "Cannot convert value '[1, 2]' to a list of '<class 'float'>'"),
        ("[1, a]", "None", "output type is not allowed, got <class 'list'>"),
    ],
)
def test_a_text_that_is_no_such_value_is_refused(names, text, kind, said):
    value = eval(f"ParameterValue(LaunchConfiguration('x', default=[{text!r}]), value_type={kind})", names)
    with pytest.raises(ValueError) as raised:  # noqa: PT011 - the text is compared below
        value.evaluate(names["context"])
    assert said in str(raised.value)
