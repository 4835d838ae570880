"""Plain processes: shell, working folder, environment, label, programs found on PATH and in packages."""

from launch import LaunchDescription
from launch.actions import ExecuteProcess, SetEnvironmentVariable
from launch.substitutions import Command, EnvironmentVariable, FindExecutable
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage


def generate_launch_description():
    return LaunchDescription(
        [
            SetEnvironmentVariable("DEMO", "set"),
            SetEnvironmentVariable(name="DEMO2", value=[EnvironmentVariable("DEMO"), "2"]),
            ExecuteProcess(cmd=["echo $DEMO2 |", "tr a-z A-Z"], shell=True, output="screen", name="shell"),
            ExecuteProcess(cmd=[FindExecutable(name="pwd")], cwd="/usr/lib", output="screen"),
            ExecuteProcess(
                cmd=[ExecutableInPackage("show", "demo"), Command(["echo ", "one two"])],
                additional_env={"DEMO": "added"},
            ),
            ExecuteProcess(
                cmd=["sh", "-c", "echo only $DEMO; exit 3"], env={"DEMO": "env", "PATH": "/bin"}, output="both"
            ),
            Node(executable="echo", arguments=["no package"]),
        ]
    )
