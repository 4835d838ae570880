"""Who imports whom in sim: without the grader, ROS in two modules only, no circles."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

from grader import KIT

ROOT = KIT
ROS = ("rclpy", "rosgraph_msgs", "rcl_interfaces", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs")


def module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imports(path: Path) -> set[str]:
    """Return the modules that a file imports anywhere, `from a import b` as both a and a.b."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.module, f"{path}: write whole names, not relative ones"
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


SIM = {module(path): imports(path) for path in sorted((ROOT / "sim").rglob("*.py"))}


def test_sim_knows_nothing_of_the_grader() -> None:
    assert not [name for name, found in SIM.items() if any(other.split(".")[0] == "grader" for other in found)]


def test_ros_is_met_in_the_bridge_and_its_messages_only() -> None:
    met = {name for name, found in SIM.items() if any(other.split(".")[0] in ROS for other in found)}
    assert met == {"sim.bridge", "sim.messages"}
    assert not any(other.startswith("rclpy") for other in SIM["sim.messages"])


def test_modules_import_one_way() -> None:
    """A package's __init__ shows what its modules have, so it is no part of the order."""
    inside = {name: (found & SIM.keys()) - {"sim", "sim.live"} for name, found in SIM.items()}
    list(TopologicalSorter(inside).static_order())  # raises CycleError, which names the circle
