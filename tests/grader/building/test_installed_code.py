"""What an install tree may hold: text, whoever wrote it, and what ROS's tools make of the interfaces."""

from __future__ import annotations

import importlib.util
import py_compile
import zipfile
from pathlib import Path

import pytest
from helpers.course import COURSE

from grader.building import installed_code, type_hashes
from grader.building.type_hashes import Generated
from grader.host import ros_env

CODE = 'def answer():\n    """Return the answer."""\n    return 42\n'
OTHER = "import os\n\nos.getpid()\n"
SITE = str(ros_env.SITE_IN_PREFIX)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A folder with the sources of a package and its install tree: `written` puts files into both."""
    for folder in ("src/p", f"install/{SITE}", "install/lib/p", "install/bin", "install/share/p/launch"):
        (tmp_path / folder).mkdir(parents=True)
    return tmp_path


def written(root: Path, **files: str) -> None:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def unknown(tree: Path, generated: dict[str, Generated] | None = None) -> list[str]:
    return installed_code.unreadable(tree / "install", tree / "src", generated or {}, COURSE.nodes)


@pytest.mark.parametrize(
    "place", [f"{SITE}/p/mod.py", f"{SITE}/mod.py", "lib/p/helper.py", "share/p/launch/all_launch.py", "share/p/x.py"]
)
def test_text_is_read_wherever_the_build_has_it_from(tree: Path, place: str):
    """CMake may have written or configured it."""
    written(tree, **{f"install/{place}": OTHER})
    assert unknown(tree) == []
    assert list(installed_code.python_texts(tree / "install", COURSE.nodes)) == [(place, OTHER.encode())]


@pytest.mark.parametrize("place", [f"{SITE}/p/mod.py", "lib/p/robot_controller"])
def test_what_only_looks_like_text_is_not(tree: Path, place: str):
    written(tree, **{f"install/{place}": "#!/usr/bin/env python3\nPK\x03\x04\0\0"})
    assert unknown(tree) == [place]


def test_what_rosidl_generates_is_known_by_its_text(tree: Path):
    made = Generated(
        modules={"srv/_set_speed.py": installed_code._digest(CODE.encode())},
        exports={"srv/__init__.py": "from p.srv._set_speed import SetSpeed\nfrom p.srv._other import Other\n"},
    )
    init = "from p.srv._set_speed import SetSpeed\n"
    written(tree / "install" / SITE, **{"p/__init__.py": "", "p/srv/__init__.py": init, "p/srv/_set_speed.py": CODE})
    assert unknown(tree, {"p": made}) == []
    written(tree / "install" / SITE, **{"p/srv/__init__.py": init + "import os\n", "p/srv/_set_speed.py": OTHER})
    assert unknown(tree, {"p": made}) == [f"{SITE}/p/srv/__init__.py", f"{SITE}/p/srv/_set_speed.py"]


def test_nothing_else_may_be_in_a_folder_of_types_whoever_handed_it_in(tree: Path):
    """Nobody lints, measures or mutates it there."""
    written(tree, **{"src/p/helpers.py": CODE, f"install/{SITE}/p/msg/helpers.py": CODE})
    assert unknown(tree) == [f"{SITE}/p/msg/helpers.py"]


@pytest.mark.sandbox
def test_ros_own_tools_make_the_modules_once_more(tmp_path: Path):
    made = type_hashes.compute({"srv/SetSpeed.srv": "float32 speed\n---\nbool success\n"}, "p", tmp_path)
    assert set(made.modules) == {"srv/_set_speed.py"}
    assert "from p.srv._set_speed import SetSpeed " in made.exports["srv/__init__.py"]


@pytest.mark.parametrize(
    "text",
    [
        "#!/usr/bin/env python3\nfrom p.robot_controller import main\n\nraise SystemExit(main())\n",
        "#!/ws/bin/python3 -u\n" + CODE,
        "import p.robot_controller\n",
        '#!/bin/sh\nexec python3 -m p.robot_controller "$@"\n',
        "#!/usr/bin/env bash\n# Run it.\nset -e\n\n/usr/bin/env python3 -u -m p.robot_controller $@\n",
        '#!/bin/sh\nHERE="$(cd "$(dirname "$0")" && pwd)"\nexec python3 "$HERE/node.py" "$@"\n',
        '#!/bin/sh\nexec python3 -c "from p.robot_controller import main; raise SystemExit(main())" "$@"\n',
        "#!/bin/sh\npython3 -c 'import sys; from p.robot_controller import main; sys.exit(main())' $@\n",
        '#!/bin/bash\nexec python3 "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/node" "$@"\n',
    ],
)
def test_the_program_of_a_node_may_start_it_in_any_plain_way(tree: Path, text: str):
    program = "#!/usr/bin/env python3\n" + CODE
    written(tree / "install", **{f"{SITE}/p/robot_controller.py": CODE, "lib/p/node.py": CODE, "lib/p/node": program})
    written(tree / "install", **{"lib/p/robot_controller": text})
    assert unknown(tree) == []


@pytest.mark.parametrize(
    "text",
    [
        '#!/bin/sh\nexec /ws/install/share/p/core "$@"\n',
        '#!/bin/sh\nexec python3 /ws/install/share/p/core "$@"\n',
        "#!/bin/sh\nexec python3 -c 'import p'\n",
        "#!/bin/sh\nexec python3 -c 'from p.not_there import main; main()'\n",
        "#!/bin/sh\nexec python3 -c 'from p.robot_controller import main; exec(main())'\n",
        "#!/bin/sh\nexec python3 -m p.not_there\n",
        "#!/bin/sh\nHERE=$(unzip core)\nexec python3 -m p.robot_controller\n",
        "#!/bin/sh\n. ./core; exec python3 -m p.robot_controller\n",
        "#!/usr/bin/perl\nexec 'core'\n",
        "#!/ws/install/share/p/python3\nimport p\n",
        "#!/bin/sh -c python3\n",
        "\x7fELF",
    ],
)
def test_a_program_that_runs_something_else_is_named(tree: Path, text: str):
    written(tree / "install", **{f"{SITE}/p/robot_controller.py": CODE, "share/p/core": OTHER})
    written(tree / "install", **{"lib/p/robot_controller": text, "lib/p/helper": text})
    assert unknown(tree) == ["lib/p/robot_controller"], "what is no node may be in any language"


@pytest.mark.parametrize("place", ["share/p/core", "lib/p/core", f"{SITE}/p/core"])
def test_an_archive_of_modules_is_named_under_any_name(tree: Path, place: str):
    """Python starts it, and imports from it."""
    written(tree / "install", **{place: ""})
    with zipfile.ZipFile(tree / "install" / place, "w") as archive:
        archive.writestr("__main__.py", CODE)
    with zipfile.ZipFile(tree / "install" / "share" / "map.npz", "w") as archive:
        archive.writestr("cells.npy", "numbers")
    assert unknown(tree) == [place]


def test_a_library_that_was_handed_in_as_a_binary_is_named_and_one_that_was_compiled_is_not(tree: Path):
    written(tree, **{"src/p/libfast.so": "\x7fELF 1", "install/lib/libfast.so": "\x7fELF 1"})
    written(tree, **{"install/lib/libp__rosidl_generator_c.so": "\x7fELF 2"})
    assert unknown(tree) == ["lib/libfast.so"]


def test_the_scripts_that_setuptools_writes_are_known_letter_by_letter(tree: Path):
    template = Path(importlib.util.find_spec("setuptools").origin).parent / "command" / "easy_install.py"
    _, _, rest = template.read_text().partition("        # EASY-INSTALL-ENTRY-SCRIPT")
    body, _, _ = rest.partition('        """\n')
    text = "        # EASY-INSTALL-ENTRY-SCRIPT" + body
    text = "\n".join(line.removeprefix("        ") for line in text.splitlines()) + "\n"
    names = {"spec": "robot-controller==1.0.0", "group": "console_scripts", "name": "robot_controller"}
    script = "#!/ws/bin/python3\n" + text % names
    written(tree, **{"install/lib/p/robot_controller": script})
    assert list(installed_code.python_texts(tree / "install", COURSE.nodes)) == []
    other = script.replace("import sys", "import sys, os")
    written(tree, **{"install/lib/p/robot_controller": other})
    assert list(installed_code.python_texts(tree / "install", COURSE.nodes)) == [
        ("lib/p/robot_controller", other.encode())
    ]


def test_a_link_among_the_modules_is_not_followed_by_those_who_count_them(tree: Path):
    written(tree, **{"src/p/mod.py": CODE, "install/share/p/mod.py": CODE})
    (tree / "install" / SITE / "mod.py").symlink_to("../../../share/p/mod.py")
    (tree / "install" / SITE / "pkg").symlink_to("../../../share/p")
    assert unknown(tree) == [f"{SITE}/mod.py", f"{SITE}/pkg"]


def test_what_colcon_and_rosidl_install_beside_the_modules_is_known(tree: Path):
    names = ("_local_setup_util_sh.py", f"{SITE}/p/p_s__rosidl_typesupport_c.so", "share/p/cmake/pConfig.cmake")
    written(tree / "install", **dict.fromkeys(names, OTHER))
    assert unknown(tree) == []
    written(tree / "install", **{f"{SITE}/p/fast.so": "\x7fELF"})
    assert unknown(tree) == [f"{SITE}/p/fast.so"]


def test_no_byte_code_survives_a_build(tree: Path):
    module = tree / "install" / SITE / "mod.py"
    module.write_text(CODE)
    py_compile.compile(str(module))
    assert installed_code.remove_byte_code(tree / "install") == []
    assert list((tree / "install").rglob("*.pyc")) == []
    assert module.read_text() == CODE


@pytest.mark.parametrize("link", ["__pycache__/mod.cpython-311.pyc", "alone.pyc", "__pycache__"])
def test_byte_code_behind_a_link_is_removed_and_flagged(tree: Path, link: str):
    """Python loads it whatever the linked file is called."""
    hidden = tree / "install" / "share" / "p" / "table.bin"
    hidden.write_bytes(b"byte code")
    path = tree / "install" / SITE / link
    path.parent.mkdir(exist_ok=True)
    path.symlink_to(hidden)
    (flag,) = installed_code.remove_byte_code(tree / "install")
    assert (flag.kind, flag.where) == ("byte code", f"{SITE}/{link}")
    assert not path.is_symlink()


def test_byte_code_that_hides_other_code_is_flagged(tree: Path):
    module = tree / "install" / SITE / "mod.py"
    module.write_text(OTHER)
    py_compile.compile(str(module), invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH)
    module.write_text(CODE)
    py_compile.compile(str(module), str(module.with_name("alone.pyc")))
    flags = installed_code.remove_byte_code(tree / "install")
    assert [flag.kind for flag in flags] == ["byte code", "byte code"]
    assert list((tree / "install").rglob("*.pyc")) == []
