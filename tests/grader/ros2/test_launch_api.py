"""Every public name of the real modules is there: it works, or it is refused with the line of the launch file."""

from __future__ import annotations

import subprocess
import sys

import pytest
from helpers.ros2_runs import COMMAND

from grader.ros2.launching import api, modules

# What launch files of students were seen to use.
WORKING = [
    ("launch.logging", "get_logger"),
    ("launch.actions", "AppendEnvironmentVariable"),
    ("launch.actions.shutdown_action", "Shutdown"),
    ("launch.substitutions.boolean_substitution", "NotSubstitution"),
    ("launch.events.process.process_exited", "ProcessExited"),
    ("launch_ros.actions", "SetParametersFromFile"),
    ("launch_ros.substitutions.find_package", "FindPackageShare"),
    ("launch.utilities.type_utils", "perform_typed_substitution"),
]
REFUSED = [
    ("launch.descriptions", "Executable"),
    ("launch.actions", "ExecuteLocal"),
    ("launch.actions", "ResetEnvironment"),
    ("launch_ros.actions", "SetROSLogDir"),
    ("launch_ros.substitutions", "Parameter"),
    ("launch.event_handlers", "OnIncludeLaunchDescription"),
    ("launch_ros.utilities", "normalize_remap_rules"),
    ("launch_ros.actions", "ComposableNodeContainer"),
    ("launch.logging", "launch_config"),
    ("launch.frontend", "Parser"),
    ("launch.events.process", "SignalProcess"),
    ("launch.substitutions", "AnonName"),
    ("launch.events.matchers", "matches_action"),
]
INNER: dict[str, list[str]] = {}
for _module, _name in [*WORKING, *REFUSED]:
    INNER.setdefault(_module, []).append(_name)


def test_every_supported_name_is_one_of_the_real_ones():
    """The names that only inner modules have are not listed."""
    real = {(module.split(".")[0], name) for module, names in api.api().items() for name in names or ()}
    own = {(module.split(".")[0], name) for module, names in modules.table().items() for name in names}
    assert {name for _, name in own - real} == {
        *("normalize_to_list_of_substitutions", "normalize_typed_substitution"),
        *("perform_substitutions", "perform_typed_substitution", "is_substitution", "FilePath"),
    }


def test_every_name_of_the_real_ones_works_or_is_refused_with_the_line_that_uses_it(tmp_path):
    file = tmp_path / "made.launch.py"
    file.write_text(f"""import importlib, sys
sys.path.insert(0, {str(COMMAND.parents[1])!r})
from grader.ros2.launching import api, modules
assert modules.install()
for module, names in api.api().items():
    for name in names if names is not None else {INNER!r}.get(module, ["anything"]):
        value = getattr(importlib.import_module(module), name)
        if type(value).__name__ != "_Refusing":
            print(module, name, "works")
            continue
        for use in (
            value, lambda: value.level, lambda: setattr(value, "level", 1), lambda: type("My", (value,), {{}})()
        ):
            try:
                use()
            except RuntimeError as error:
                assert f"made.launch.py, line 1" in str(error), error
                assert f": {{name}} of {{module}} is not supported by the launch of this kit." in str(error), error
            else:
                raise AssertionError(f"{{module}} {{name}}")
        print(module, name, "is refused")
""")
    done = subprocess.run([sys.executable, file], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    said = done.stdout.splitlines()
    assert {f"{module} {name} works" for module, name in WORKING} <= set(said)
    assert {f"{module} {name} is refused" for module, name in REFUSED} <= set(said)
    asked = [INNER.get(module, ["anything"]) if names is None else names for module, names in api.api().items()]
    assert len(said) == sum(map(len, asked))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            "from launch.event_handlers import OnIncludeLaunchDescription as On\nOn(entities=[])",
            "line 2: OnIncludeLaunchDescription of launch.event_handlers is not supported by the launch of this kit. "
            "Include the file with IncludeLaunchDescription of launch.actions.",
        ),
        (
            "import launch_ros.utilities\n\nlaunch_ros.utilities.normalize_remap_rules([])",
            "line 3: normalize_remap_rules of launch_ros.utilities is not supported by the launch of this kit.",
        ),
        (
            "import launch\nlaunch.logging.launch_config.level = 10",
            "line 2: launch_config of launch.logging is not supported by the launch of this kit.",
        ),
        ("from launch.logging import get_loger", "cannot import name 'get_loger' from 'launch.logging'"),
        ("import launch.actoins", "No module named 'launch.actoins'"),
    ],
)
def test_a_name_that_is_not_supported_is_one_message(launch, tmp_path, line, words):
    file = tmp_path / "made.launch.py"
    file.write_text(line + "\n")
    run = launch(file).end()
    assert run.code == 1
    assert words in run.out
    assert "made.launch.py" in run.out
    assert "Traceback" not in run.out + run.err


def test_what_a_launch_file_logs_looks_like_what_the_launch_logs(launch, tmp_path):
    file = tmp_path / "made.launch.py"
    file.write_text("""import launch
import launch.logging
from launch.actions import OpaqueFunction

launch.logging.get_logger().info("while it is read")


def say(context):
    launch.logging.get_logger("mine").warning("speed is %s", 0.2)
    launch.logging.get_logger("mine").debug("not shown")


def generate_launch_description():
    return launch.LaunchDescription([OpaqueFunction(function=say)])
""")
    run = launch(file).end()
    assert run.code == 0
    assert "[INFO] [root]: while it is read\n[WARNING] [mine]: speed is 0.2\n" in run.out
    assert "not shown" not in run.out
    (log,) = (tmp_path / "log").glob("*/launch.log")
    assert " [WARNING] [mine]: speed is 0.2\n" in log.read_text()
