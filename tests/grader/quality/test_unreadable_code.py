"""Code that no reader sees is named: made at run time, loaded from what is no module, started as another program."""

from __future__ import annotations

import pytest
from helpers.course import COURSE, PACKAGE

from grader.quality.parsed_module import parse
from grader.quality.unreadable_code import unreadable_code


def named(text: str, path: str = "ros2_robot_controller/driver.py") -> list[str]:
    module = parse("ros2_robot_controller/robot_controller.py", b"X = 1\n", PACKAGE)
    return [
        finding.text for finding in unreadable_code([module, parse(path, text.encode(), PACKAGE)], COURSE.demonstration)
    ]


@pytest.mark.parametrize(
    "text",
    [
        "exec(open('x').read())", "x: exec(open('x').read()) = 0", "run = exec",
        "exec = exec\nexec('x')", "eval(text)", "compile(a, b, 'exec')",
        "getattr(__builtins__, name)(text)", "import builtins", "getattr(sys.modules['builtins'], name)",
        "__import__(name)", "__import__('runpy')", "import runpy", "from runpy import run_path", "import zipimport",
        "import runpy\nrunpy.run_module(name)",
        "import runpy\nrunpy.run_module('ros2_robot_controller.robot_controller')\nrun = runpy.run_path",
        "import marshal", "from importlib import machinery",
        "from importlib.machinery import SourcelessFileLoader", "import ctypes", "types.FunctionType(code, {})",
        "().__class__.__base__.__subclasses__()", "main.__code__ = other", "import os\nos.execv(path, [path])",
        "import os\nos.system('python3 core')", "import subprocess\nsubprocess.run(['sh', 'core'])",
        "from subprocess import run\nrun(['/ws/install/lib/p/core'])",
        "import os\nos.execvp('python3', ['python3', 'core'])",
    ],
)  # fmt: skip
def test_code_that_no_reader_sees_is_named(text: str):
    assert named(text + "\n")


@pytest.mark.parametrize(
    "text",
    [
        "import importlib\nimportlib.import_module('ros2_robot_controller.driver')", "import re\nre.compile('x')",
        "from re import compile\ncompile('x')", "model.eval()",
        "from .code import Code", "from ros2_robot_controller import code",
        "__path__ = __import__('pkgutil').extend_path(__path__, __name__)",
        "import importlib.util\nimportlib.util.find_spec('numpy')",
        "def spin():\n    exec = SingleThreadedExecutor()\n    exec.add_node(node)",
        "def compile(readings):\n    return ''\n\ndef summary(readings):\n    return compile(readings)",
        "import ast\nast.literal_eval(text)", "executor.execute(goal)", "import sys\nsys.path.append('..')",
        "import os\nos.execvp('python3', ['python3', '-m', 'ros2_robot_controller.robot_controller'])",
        "import subprocess\nsubprocess.run(['aplay', 'beep.wav'])",
        "import runpy\nrunpy.run_module('ros2_robot_controller.robot_controller', run_name='__main__')",
    ],
)  # fmt: skip
def test_ordinary_code_is_not(text: str):
    assert named(text + "\n") == []


@pytest.mark.parametrize("path", ["test/test_driver.py", "setup.py", "scripts/demo.py"])
def test_what_runs_in_no_node_may_do_as_it_likes(path: str):
    assert named("exec(open('x').read())\n", path) == []
