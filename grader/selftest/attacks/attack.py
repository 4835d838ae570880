"""What an attack is: a small named edit of a package, what it tries, and the right outcome. Data only."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

PACKAGE = "ros2_robot_controller"

Change = Callable[[Path], None]
"""An edit of a package's folder."""
Pack = Callable[[Path, Path], Path]
"""Makes what is handed in, below a folder, from the package."""

_NOT_COPIED = shutil.ignore_patterns("__pycache__", ".pytest_cache", "build", "install", "log")


@dataclass(frozen=True)
class Attack:
    """One attempt at points that were not earned, or at what does not belong to the submission.

    In texts `@SECRET@`, `@TOKEN@`, `@PORT@`, `@RESULTS@`, `@NEIGHBOUR@`, `@KIT@` stand for what the scene of the attack
    plants on the host (scene.py).

    Attributes:
        name: what it is called.
        tries: what it tries, as a sentence.
        stopped: what stops it, in words.
        number: its number in the catalogue of known attacks on autograders; 0 for one that we added.
        needs: the requirements that have to be graded to see what comes of it.
        changes: its edits of the package.
        weak: the weakness that the package has, with and without the attack: what there is to win.
        costs: the requirements that may lose points by it; all others must come out as without it.
        flag: the kind of integrity flag that it must raise, "" where there is nothing to be seen of it.
        proof: words that must stand in the evidence, to show that it was really carried out.
        pack: how it is handed in, if not as a folder.
        refused: words of the refusal, if it is not graded at all.
        build_seconds: how long it may build, if not as long as any.
        no_door: why there is nothing here that it could be tried on; then it is not run.
    """

    name: str
    tries: str
    stopped: str = ""
    number: int = 0
    needs: tuple[str, ...] = ()
    changes: tuple[Change, ...] = ()
    weak: str = ""
    costs: frozenset[str] = frozenset()
    flag: str = ""
    proof: str = ""
    pack: Pack | None = None
    refused: str = ""
    no_door: str = ""
    build_seconds: float = 0.0


def attack(
    name: str,
    tries: str,
    *changes: Change,
    stopped: str = "",
    number: int = 0,
    needs: str = "",
    weak: str = "",
    costs: str = "",
    flag: str = "",
    proof: str = "",
    pack: Pack | None = None,
    refused: str = "",
    no_door: str = "",
    build_seconds: float = 0.0,
) -> Attack:
    """Return an attack; `needs` and `costs` are requirements separated by blanks."""
    return Attack(
        name, tries, stopped, number, tuple(needs.split()), changes, weak, frozenset(costs.split()), flag, proof,
        pack, refused, no_door, build_seconds,
    )  # fmt: skip


def copy(package: Path, folder: Path) -> Path:
    """Copy a package's source below `folder` and return the copy."""
    target = folder / PACKAGE
    shutil.copytree(package, target, ignore=_NOT_COPIED)
    return target


def put(path: str, text: str, *, executable: bool = False) -> Change:
    """Write a file of the package."""

    def change(package: Path) -> None:
        file = package / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        if executable:
            file.chmod(0o755)

    return change


def append(path: str, text: str) -> Change:
    """Add text to the end of a file."""

    def change(package: Path) -> None:
        file = package / path
        file.write_text((file.read_text() if file.exists() else "") + text)

    return change


def replace(path: str, old: str, new: str) -> Change:
    """Replace a text that must stand in a file exactly once."""

    def change(package: Path) -> None:
        text = (package / path).read_text()
        if text.count(old) != 1:
            raise ValueError(f"{old!r} stands {text.count(old)} times in {path}, not once")
        (package / path).write_text(text.replace(old, new))

    return change


def remove(path: str) -> Change:
    """Take a file or a folder away."""

    def change(package: Path) -> None:
        target = package / path
        if target.is_dir():
            shutil.rmtree(target)
        else:
            target.unlink(missing_ok=True)

    return change


def node(payload: str, executable: str = "robot_controller", *, before: str = "") -> Change:
    """Run `payload` when a node starts, then the node. It may use os, sys, subprocess, threading, time.

    What it prints stands in the trial's evidence. A payload that fails says so, and the node starts all the same.
    """
    indented = "".join(f"    {line}\n" if line else "\n" for line in payload.strip().splitlines())
    text = (
        "#!/usr/bin/env python3\nimport os\nimport subprocess\nimport sys\nimport threading\nimport time\n"
        f"{before}\n\ndef attack():\n{indented}\n\ntry:\n    attack()\n"
        "except Exception as error:\n    print('ATTACK', type(error).__name__, error, flush=True)\n\n"
        f"from {PACKAGE}.{executable} import main\nsys.exit(main())\n"
    )
    return put(f"scripts/{executable}", text, executable=True)


def beside(payload: str, executable: str = "robot_controller") -> Change:
    """Run `payload` beside a node; it may use `node`, its own, `spin(seconds)` and `spin_until(holds)`."""
    indented = "".join(f"        {line}\n" if line else "\n" for line in payload.strip().splitlines())
    text = (
        "context = rclpy.Context()\nrclpy.init(context=context)\n"
        "node = rclpy.create_node(NAME, context=context, enable_rosout=False)\n"
        "executor = SingleThreadedExecutor(context=context)\nexecutor.add_node(node)\n\n"
        "def spin(seconds):\n    end = time.monotonic() + seconds\n    while time.monotonic() < end:\n"
        "        executor.spin_once(timeout_sec=0.01)\n\n"
        "def spin_until(holds):\n    end = time.monotonic() + 2.0\n"
        "    while not holds() and time.monotonic() < end:\n        executor.spin_once(timeout_sec=0.01)\n\n"
        "def run():\n    try:\n" + indented + "    except Exception as error:\n"
        "        print('ATTACK', type(error).__name__, error, flush=True)\n\n"
        "threading.Thread(target=run, daemon=True).start()"
    )
    before = "import rclpy\nfrom rclpy.executors import SingleThreadedExecutor\nNAME = 'helper'\n"
    return node(text, executable, before=before)


def cmake(text: str) -> Change:
    """Put commands into CMakeLists.txt before its end."""
    return replace("CMakeLists.txt", "\nament_package()", f"\n{text.strip()}\n\nament_package()")


@dataclass(frozen=True)
class Filled:
    """Words that stand for what a scene has planted, and what they stand for."""

    words: Mapping[str, str] = field(default_factory=dict)

    def text(self, text: str) -> str:
        """Return `text` with the words filled in."""
        for word, value in self.words.items():
            text = text.replace(f"@{word}@", value)
        return text

    def folder(self, package: Path) -> None:
        """Fill in the words in every file of the package."""
        for path in package.rglob("*"):
            if path.is_file() and not path.is_symlink():
                old = path.read_bytes()
                if b"@" in old:
                    new = self.text(old.decode("utf-8", "surrogateescape")).encode("utf-8", "surrogateescape")
                    if new != old:
                        path.write_bytes(new)
