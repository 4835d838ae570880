"""Attacks that every host stops alike: by form, text, answers, tests, what is installed, and on the observer.

Those by form are in on_intake.py, the others in on_*.yaml, with the attributes of `Attack` and these changes of a
package: those of submissions/known_bad.yaml (`put` may be `executable`), `append` with a `text`, `cmake` (commands at
the end of CMakeLists.txt), `node` (runs when a node starts), `beside` (runs beside a node), and `call` of a function
in made.py. `weak` names changes in weaknesses.py. A text may be a list, of texts and of what is repeated some `times`,
in which {n} counts from 0 and {next} from 1. Below `texts` is what several attacks use.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml
from submissions import edits

from attacks import made, on_intake, weaknesses
from grader.intake.package_edits import Change, append, put
from grader.selftest.attacks.attack import Attack, attack, cmake, node
from grader.selftest.attacks.on_nodes import CREEPS
from grader.yaml_reader import FAST_LOADER


def beside(payload: str) -> Change:
    """Return a change that runs `payload` beside a node; it may use its own `node`, `spin(s)` and `spin_until(f)`.

    The attacked node starts when the payload calls `bites()`, or ends: a trial takes a second or two, and would be over
    before a side process is up. `observed()` tells whether the observer and its topics have been discovered.
    """
    indented = "".join(f"        {line}\n" if line else "\n" for line in payload.strip().splitlines())
    text = (
        "context = rclpy.Context()\nrclpy.init(context=context)\n"
        "node = rclpy.create_node(NAME, context=context, enable_rosout=False)\n"
        "executor = SingleThreadedExecutor(context=context)\nexecutor.add_node(node)\n\n"
        "def spin(seconds):\n    end = time.monotonic() + seconds\n    while time.monotonic() < end:\n"
        "        executor.spin_once(timeout_sec=0.01)\n\n"
        "def spin_until(holds):\n    end = time.monotonic() + 30.0\n"
        "    while not holds() and time.monotonic() < end:\n        executor.spin_once(timeout_sec=0.01)\n\n"
        "def observed():\n"
        "    return 'simulated_robot' in node.get_node_names() and node.count_subscribers('cmd_vel')\n\n"
        "up = threading.Event()\nbites = up.set\n\n"
        "def run():\n    try:\n" + indented + "    except Exception as error:\n"
        "        print('ATTACK', type(error).__name__, error, flush=True)\n    finally:\n        up.set()\n\n"
        "threading.Thread(target=run, daemon=True).start()\nup.wait()"
    )
    before = "import rclpy\nfrom rclpy.executors import SingleThreadedExecutor\nNAME = 'helper'\n"
    return node(text, "robot_controller", before=before)


def _text(given: str | list[Any]) -> str:
    if isinstance(given, str):
        return given
    repeated = [[part] if isinstance(part, str) else _repeated(**part) for part in given]
    return "".join(text for texts in repeated for text in texts)


def _repeated(times: int, text: str) -> list[str]:
    return [text.replace("{next}", str(n + 1)).replace("{n}", str(n)) for n in range(times)]


def _change(given: dict[str, Any]) -> Change:
    match given:
        case {"put": file, "text": text}:
            return put(file, _text(text), executable="executable" in given)
        case {"append": file, "text": text}:
            return append(file, _text(text))
        case {"cmake": text}:
            return cmake(text)
        case {"node": text}:
            return node(text)
        case {"beside": text}:
            return beside(text)
        case {"call": name}:
            change: Change = getattr(made, name)
            return change
    return edits.changes([given])[0]


def _weak(given: str | list[dict[str, Any]]) -> tuple[Change, ...]:
    if isinstance(given, list):
        return tuple(map(_change, given))
    found: tuple[Change, ...] = CREEPS if given == "CREEPS" else getattr(weaknesses, given)
    return found


def _listed() -> Iterable[Attack]:
    for path in sorted(Path(__file__).parent.glob("on_*.yaml")):
        given = yaml.load(path.read_text(), FAST_LOADER)
        given.pop("texts", None)
        for name, fields in given.items():
            weak, changes = _weak(fields.pop("weak", [])), map(_change, fields.pop("changes"))
            yield attack(name, fields.pop("tries"), *changes, weak=weak, **fields)


ATTACKS: tuple[Attack, ...] = (*on_intake.ATTACKS, *_listed())
