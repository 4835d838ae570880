"""What a node can come to is told generously: each way of calling counts, and what only tests call does not."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest
from helpers.course import COURSE
from helpers.quality_examples import written

from grader.quality.reachability import Reachability, reachability

NODE = """
    from rclpy.node import Node
    from pkg import helpers


    class RobotController(Node):
        def __init__(self):
            super().__init__('robot_controller')
            {use}


    def main():
        RobotController()
"""
HELPERS = """
    def wanted():
        return 1


    def only_tests_call_this():
        return 2
"""


def found(folder: Path, modules: dict[str, str], programs: dict[str, str] | None = None) -> Reachability:
    for name, text in (programs or {}).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(dedent(text))
    return reachability(folder, {f"pkg/{name}": dedent(text).lstrip() for name, text in modules.items()}, course=COURSE)


def unreached(folder: Path, modules: dict[str, str], programs: dict[str, str] | None = None) -> set[str]:
    """Return the names of the functions and classes that are not reached."""
    reach = found(folder, modules, programs)
    lines = {path: dedent(modules[path.removeprefix("pkg/")]).lstrip().splitlines() for path in reach.unreached}
    heads = [lines[path][number - 1].split() for path, numbers in reach.unreached.items() for number in numbers]
    return {words[1].partition("(")[0].rstrip(":") for words in heads if words and words[0] in ("def", "class")}


@pytest.mark.parametrize(
    "use",
    [
        "helpers.wanted()",
        "self.create_timer(0.1, helpers.wanted)",
        "self.create_subscription(int, 'scan', lambda message: helpers.wanted(), 10)",
        "self.create_service(int, 'set_speed', callback=functools.partial(helpers.wanted, 1))",
        "ActionServer(self, int, 'navigate', execute_callback=helpers.wanted)",
        "threading.Thread(target=helpers.wanted).start()",
        "self.steps = {'stop': helpers.wanted}",
        "getattr(helpers, 'wanted')()",
        "getattr(helpers, f'want{self.end}')()",
        "getattr(helpers, 'wan' + self.end)()",
        "importlib.import_module('pkg.helpers').wanted()",
        "from pkg.helpers import wanted as other; other()",
    ],
)
def test_each_way_to_a_function_reaches_it_and_nothing_else(tmp_path: Path, use: str):
    modules = {"robot_controller.py": NODE.format(use=use), "helpers.py": HELPERS}
    assert unreached(tmp_path, modules) == {"only_tests_call_this"}


METHODS = """
    import functools
    import threading
    from rclpy.node import Node


    class Base(Node):
        def on_scan(self, message):
            return self.hook()

        def hook(self):
            return 0


    class Worker(threading.Thread):
        def run(self):
            return 1


    class RobotController(Base):
        def __init__(self):
            self.create_subscription(int, 'scan', self.on_scan, 10)
            Worker().start()
            print(self.speed, len(self))

        @property
        def speed(self):
            return 0.1

        def hook(self):
            return 1

        def __len__(self):
            return 1

        def destroy_node(self):
            return True

        def padding(self):
            return self.more_padding()

        def more_padding(self):
            return 2


    def main():
        RobotController()
"""


def test_callbacks_overrides_properties_and_threads_are_reached_but_not_methods_that_nothing_names(tmp_path: Path):
    assert unreached(tmp_path, {"robot_controller.py": METHODS}) == {"padding", "more_padding"}


def test_functions_that_call_each_other_without_a_node_are_not_reached(tmp_path: Path):
    chain = "".join(f"def step{n}():\n    return step{n + 1}()\n\n\n" for n in range(3000)) + "def step3000(): pass\n"
    modules = {"robot_controller.py": NODE.format(use="pass"), "helpers.py": chain}
    assert len(unreached(tmp_path, modules)) == 3001
    modules = {"robot_controller.py": NODE.format(use="helpers.step0()"), "helpers.py": chain}
    assert unreached(tmp_path, modules) == set()


def test_a_table_that_nothing_uses_and_all_reach_nothing(tmp_path: Path):
    helpers = dedent(HELPERS) + "\n\n__all__ = ['only_tests_call_this']\nTABLE = [only_tests_call_this]\n"
    modules = {"robot_controller.py": NODE.format(use="helpers.wanted()"), "helpers.py": helpers}
    assert unreached(tmp_path, modules) == {"only_tests_call_this"}
    modules["robot_controller.py"] = NODE.format(use="helpers.TABLE[0](helpers.wanted())")
    assert unreached(tmp_path, modules) == set()


def test_a_module_that_nothing_imports_is_not_reached(tmp_path: Path):
    modules = {"robot_controller.py": NODE.format(use="pass"), "helpers.py": "", "pad.py": "A = 1\nB = 2\n"}
    assert found(tmp_path, modules).unreached == {"pkg/pad.py": frozenset({1, 2})}


def test_a_registry_keeps_what_its_decorator_is_given(tmp_path: Path):
    helpers = "def register(f):\n    return f\n\n\n@register\ndef by_name():\n    return 1\n"
    modules = {"robot_controller.py": NODE.format(use="pass"), "helpers.py": helpers}
    assert unreached(tmp_path, modules) == set()


def test_the_contracts_conversions_are_always_reached(tmp_path: Path):
    conversions = "def clamp(value, low, high):\n    return cut(value)\n\n\ndef cut(value):\n    return value\n\n\n"
    modules = {"robot_controller.py": "", "utils/conversions.py": conversions + "def other():\n    return 1\n"}
    assert unreached(tmp_path, modules) == {"other"}


# -- which modules are a node's


def test_a_node_with_layers_has_the_modules_of_its_classes(tmp_path: Path):
    modules = {
        "robot_controller.py": "from pkg.driver import Driver\n\nclass RobotController(Driver):\n    pass\n",
        "driver.py": "from rclpy.node import Node\nfrom pkg.base import Base\n\nclass Driver(Base):\n    pass\n",
        "base.py": "from rclpy.node import Node\n\nclass Base(Node):\n    pass\n",
        "sensor_processor.py": "from pkg.base import Base\n\nclass SensorProcessor(Base):\n    pass\n",
    }
    assert found(tmp_path, modules).homes == {
        "robot_controller": {"pkg/robot_controller.py", "pkg/driver.py"},
        "sensor_processor": {"pkg/sensor_processor.py"},
    }, "what both nodes use is neither's own"


@pytest.mark.parametrize(
    "programs",
    [
        {"setup.py": "setup(entry_points={'console_scripts': ['robot_controller = pkg.drive:start']})\n"},
        {"setup.cfg": "[options.entry_points]\nconsole_scripts =\n    robot_controller = pkg.drive:start\n"},
        {"scripts/robot_controller": "#!/usr/bin/env python3\nfrom pkg.drive import start\nstart()\n"},
    ],
)
def test_a_node_under_another_name_is_found_by_its_executable(tmp_path: Path, programs: dict[str, str]):
    drive = "def start():\n    return go()\n\n\ndef go():\n    return 1\n\n\ndef never():\n    return 2\n"
    assert found(tmp_path, {"drive.py": drive}, programs).homes == {"robot_controller": {"pkg/drive.py"}}
    assert unreached(tmp_path, {"drive.py": drive}, programs) == {"never"}


def test_a_node_that_only_passes_on_main_has_the_module_it_takes_it_from(tmp_path: Path):
    modules = {"robot_controller.py": "from pkg.impl import main\n", "impl.py": "def main():\n    return 1\n"}
    assert found(tmp_path, modules).homes == {"robot_controller": {"pkg/robot_controller.py", "pkg/impl.py"}}
    assert unreached(tmp_path, modules) == set()


CORE = """
    from rclpy.node import Node


    class RobotController(Node):
        def on_scan(self, scan):
            return scan


    def main():
        RobotController()
"""


@pytest.mark.parametrize("second", ["pkg", "pkg_interfaces"])
@pytest.mark.parametrize(
    "face",
    [
        "from {second}.core import main\n",
        "from {second}.core import *\n",
        "from {second} import core\n\n\ndef main():\n    core.main()\n",
        "import {second}.core\n\n\ndef main():\n    {second}.core.main()\n",
        "from {second} import core\n\n\nclass Face(core.RobotController):\n    pass\n\n\ndef main():\n    Face()\n",
        "from {second} import between\n\n\ndef main():\n    between.run()\n",
        "from {second} import core\n\n\nclass Face(Node):\n    pass\n\n\ndef main():\n    core.main()\n",
    ],
)  # fmt: skip
def test_the_module_that_makes_the_node_is_its_own_in_whichever_package_and_however_it_is_called(
    tmp_path: Path, face: str, second: str
):
    """Else a few lines in sight would weigh as much as all the code elsewhere: no module weighs more than the nodes."""
    texts = {
        "pkg/robot_controller.py": face.format(second=second),
        f"{second}/between.py": f"from {second} import core\n\n\ndef run():\n    core.main()\n",
        f"{second}/core.py": dedent(CORE).lstrip(),
    }
    assert reachability(tmp_path, texts, course=COURSE).homes == {
        "robot_controller": {"pkg/robot_controller.py", f"{second}/core.py"}
    }


@pytest.mark.parametrize(
    "started",
    [
        {"lib/pkg/robot_controller": CORE},
        {"lib/pkg/robot_controller": "from real import main\nmain()\n", "lib/pkg/real.py": CORE},
        {"lib/pkg/robot_controller": "import sys\nsys.path.append('x')\nimport real\n", "share/pkg/x/real.py": CORE},
    ],
)
def test_a_module_that_only_looks_like_the_node_is_not_its_own(tmp_path: Path, started: dict[str, str]):
    started = {path: dedent(text) for path, text in started.items()}
    face = dedent(CORE).replace("on_scan", "tidy")
    assert reachability(tmp_path, {"pkg/robot_controller.py": face}, started, course=COURSE).homes == {}
    copied = reachability(tmp_path, {"pkg/robot_controller.py": dedent(CORE)}, started, course=COURSE)
    assert copied.homes == {"robot_controller": {"pkg/robot_controller.py"}}, "the module may be installed twice"


def test_a_package_without_a_module_of_the_contract_has_no_nodes(tmp_path: Path):
    reach = found(tmp_path, {"talker.py": "def main():\n    return 1\n"})
    assert (reach.homes, reach.of_contract) == ({}, False)
    assert found(tmp_path, {"utils/conversions.py": "def clamp():\n    return 1\n"}).of_contract


def test_the_line_of_a_def_is_not_inside_the_function(tmp_path: Path):
    text = 'def f(\n    a=1,\n):\n    """Say it."""\n    return a\n\n\ndef g(): return 1\n'
    assert found(tmp_path, {"robot_controller.py": text}).bodies == {"pkg/robot_controller.py": frozenset({5})}


@pytest.mark.parametrize("folder", ["pkg", "src_py"])
def test_a_folder_may_be_installed_under_the_packages_name(tmp_path: Path, folder: str):
    """As by `install(DIRECTORY src_py/ DESTINATION ${PYTHON_INSTALL_DIR}/pkg)`: pkg.helpers is in src_py."""
    program = "#!/usr/bin/env python3\nfrom pkg.robot_controller import main\n"
    manifest = "<package format='3'><name>pkg</name></package>"
    written(tmp_path, {"package.xml": manifest, "scripts/robot_controller": program})
    node = dedent(NODE.format(use="helpers.wanted()")).lstrip()
    reach = reachability(
        tmp_path,
        {f"{folder}/robot_controller.py": node, f"{folder}/helpers.py": dedent(HELPERS).lstrip()},
        course=COURSE,
    )
    assert reach.unreached == {f"{folder}/helpers.py": frozenset({5, 6})}
