"""`grader/ros2` and `sim` are of use by themselves: pip installs each into an empty folder, where the kit is not."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from helpers.ros2_runs import FILES

from grader import KIT

# Whoever imports the kit gets an error; `sim` itself must come from the folder.
WITHOUT_THE_KIT = "import sys; sys.path.insert(0, {target!r}); sys.modules['grader'] = None; "
DRIVE = """
import sim
from sim import Simulator, Twist, drive, load_world, world_names
from sim.views import run_view
assert sim.__file__.startswith(sys.path[0]), sim.__file__
assert len(world_names()) > 10 and load_world("yard")
run = drive(Simulator(load_world("wall_ahead")), lambda seen: Twist(0.3, 0.0), 8.0)
assert run_view(run)._repr_png_()
import sim.bag, sim.bridge, sim.film, sim.live
exec(open(sys.path[0] + "/README.py").read())
print(sorted(name for name in sys.modules if name.split(".")[0] in ("grader", "solution_pkg")))
"""
LAUNCH = """
from ros2kit.cli import main
sys.exit(main(["launch", {file!r}, "--show-args"]))
"""


@pytest.fixture(scope="module", params=["sim", "grader/ros2"])
def installed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Return a package's folder in the kit, and the folder into which it has been installed, offline."""
    folder = tmp_path_factory.mktemp("alone")
    source, target = folder / "source", folder / "target"
    shutil.copytree(KIT / request.param, source, ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run(
        [
            *(Path(sys.prefix) / "bin" / "uv", "pip", "install", "--quiet", "--offline", "--no-deps"),
            *("--no-build-isolation", "--python", sys.executable, "--target", target, source),
        ],
        check=True,
    )
    return request.param, target


@pytest.mark.slow  # pip installs each
def test_each_runs_without_the_kit(installed: tuple[str, Path]):
    """Worlds and templates are in the package, nothing of the grader is asked for, and the README is right."""
    package, target = installed
    readme = (KIT / package / "README.md").read_text()
    (target / "README.py").write_text("\n".join(re.findall(r"```python\n(.*?)```", readme, re.DOTALL)))
    code = DRIVE if package == "sim" else LAUNCH.format(file=str(FILES / "arguments.launch.py"))
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_THE_KIT.format(target=str(target)) + code],
        cwd=target, env={"PATH": "/usr/bin:/bin"}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert ("['grader']\n" if package == "sim" else "Arguments (pass arguments as") in done.stdout
    if package == "grader/ros2":
        assert (target / "bin" / "ros2").is_file()


def test_each_has_every_module_and_file_that_it_has_in_the_kit(installed: tuple[str, Path]):
    package, target = installed
    name = "sim" if package == "sim" else "ros2kit"
    of_the_kit = {
        "README.md",
        "pyproject.toml",
        "setup.bash",
        "wheels.cmake",
    }  # the last two prepare the kit's terminal
    there = {str(p.relative_to(target / name)) for p in (target / name).rglob("*") if p.is_file()}
    here = {str(p.relative_to(KIT / package)) for p in (KIT / package).rglob("*") if p.is_file()}
    assert {p for p in there if "__pycache__" not in p} == {p for p in here if "__pycache__" not in p} - of_the_kit


@pytest.mark.parametrize("package", ["sim", "grader/ros2"])
def test_its_version_and_pythons_are_those_of_the_kit(package: str):
    mine, kits = (tomllib.loads((KIT / p / "pyproject.toml").read_text())["project"] for p in (package, "."))
    assert [mine[key] for key in ("version", "requires-python", "license")] == [
        kits[key] for key in ("version", "requires-python", "license")
    ]
    named = {requirement for extra in kits["optional-dependencies"].values() for requirement in extra}
    assert set(mine["dependencies"]) <= named | set(kits["dependencies"])
