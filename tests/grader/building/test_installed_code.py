"""What an install tree may hold: no byte code, and among the types what ROS's tools make of the interfaces."""

from __future__ import annotations

import hashlib
import py_compile
from pathlib import Path

import pytest
from helpers import course as spec
from helpers.archives import write

from grader.building import install_tree
from grader.building.install_tree import Generated
from grader.host import ros_env

CODE = 'def answer():\n    """Return the answer."""\n    return 42\n'
OTHER = "import os\n\nos.getpid()\n"
SITE = str(ros_env.SITE_IN_PREFIX)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for folder in (f"install/{SITE}", "install/share/p"):
        (tmp_path / folder).mkdir(parents=True)
    return tmp_path


def test_what_rosidl_generates_is_known_by_its_text(tree: Path):
    made = Generated(
        modules={"srv/_set_speed.py": hashlib.sha256(CODE.encode()).hexdigest()},
        exports={"srv/__init__.py": "from p.srv._set_speed import SetSpeed\nfrom p.srv._other import Other\n"},
    )
    init = "from p.srv._set_speed import SetSpeed\n"
    write(tree / "install" / SITE, {"p/__init__.py": "", "p/srv/__init__.py": init, "p/srv/_set_speed.py": CODE})
    assert install_tree.not_generated(tree / "install", {"p": made}) == []
    write(tree / "install" / SITE, {"p/srv/__init__.py": init + "import os\n", "p/srv/_set_speed.py": OTHER})
    found = install_tree.not_generated(tree / "install", {"p": made})
    assert found == [f"{SITE}/p/srv/__init__.py", f"{SITE}/p/srv/_set_speed.py"]


def test_nothing_else_may_be_in_a_folder_of_types(tree: Path):
    """Nobody lints, measures or mutates it there."""
    write(tree / "install" / SITE, {"p/msg/helpers.py": CODE, "p/msg/fast.so": "ELF", "p/msg/_a_s.c": "int a;"})
    found = install_tree.not_generated(tree / "install", {})
    assert found == [f"{SITE}/p/msg/fast.so", f"{SITE}/p/msg/helpers.py"]


@pytest.mark.sandbox
def test_ros_own_tools_make_the_modules_once_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    texts = {"srv/SetSpeed.srv": "float32 speed\n---\nbool success\n"}
    made = install_tree.generate(texts, "p", tmp_path)
    monkeypatch.setattr(install_tree.sandbox, "run", lambda *_: pytest.fail("what is kept was made again"))
    assert install_tree.generate(texts, "p", tmp_path) == made
    assert set(made.modules) == {"srv/_set_speed.py"}
    assert "from p.srv._set_speed import SetSpeed " in made.exports["srv/__init__.py"]


def test_no_byte_code_survives_a_build(tree: Path):
    module = tree / "install" / SITE / "mod.py"
    module.write_text(CODE)
    py_compile.compile(str(module))
    assert install_tree.remove_byte_code(tree / "install") == []
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
    (flag,) = install_tree.remove_byte_code(tree / "install")
    assert (flag.kind, flag.where) == ("byte code", f"{SITE}/{link}")
    assert not path.is_symlink()


def test_byte_code_in_place_of_a_module_is_flagged(tree: Path):
    module = tree / "install" / SITE / "mod.py"
    module.write_text(OTHER)
    py_compile.compile(str(module), invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH)
    py_compile.compile(str(module), str(module.with_name("alone.pyc")))
    (flag,) = install_tree.remove_byte_code(tree / "install")
    assert (flag.kind, flag.where) == ("byte code", f"{SITE}/alone.pyc")
    assert list((tree / "install").rglob("*.pyc")) == []


# -- the hashes of types, from the text of their definitions ----------------------------------------------------------
@pytest.mark.slow  # a run of rosidl; each build of the contract compares them
@pytest.mark.sandbox
def test_hashes_are_computed_from_the_text(tmp_path: Path):
    texts = install_tree.definitions(spec.CONTRACT)
    found = install_tree.generate(texts, spec.PACKAGE, tmp_path)
    assert sorted(found.hashes) == sorted(spec.INTERFACES)
    # A comment is not part of a type, the type of a field is.
    commented = {name: f"# {name}\n{text}" for name, text in texts.items()}
    assert install_tree.generate(commented, spec.PACKAGE, tmp_path).hashes == found.hashes
    changed = {**texts, "srv/SetSpeed.srv": texts["srv/SetSpeed.srv"].replace("float32", "float64")}
    other = install_tree.generate(changed, spec.PACKAGE, tmp_path)
    assert [name for name, digest in found.hashes.items() if digest != other.hashes[name]] == ["srv/SetSpeed"]


@pytest.mark.slow  # a run of rosidl more
@pytest.mark.sandbox
def test_a_definition_that_cannot_be_read_takes_no_other_along(tmp_path: Path):
    texts = install_tree.definitions(spec.CONTRACT)
    good = install_tree.generate(texts, spec.PACKAGE, tmp_path)
    with_bad = install_tree.generate({**texts, "msg/Bad.msg": "floot x\n = y"}, spec.PACKAGE, tmp_path)
    assert with_bad.hashes == good.hashes
    assert with_bad.modules == good.modules
