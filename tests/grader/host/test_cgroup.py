"""Where cgroups can be made."""

from __future__ import annotations

from pathlib import Path

from grader.host import cgroup


def test_version_1_needs_memory_and_processes(tmp_path: Path):
    assert cgroup.find_hierarchy(tmp_path / "nothing") is None
    own = dict(line.split(":")[1:] for line in Path("/proc/self/cgroup").read_text().split())
    (tmp_path / "memory" / own.get("memory", "/").lstrip("/")).mkdir(parents=True)
    assert cgroup.find_hierarchy(tmp_path) is None
    (tmp_path / "pids" / own.get("pids", "/").lstrip("/")).mkdir(parents=True)
    cgroup.find_hierarchy.cache_clear()
    found = cgroup.find_hierarchy(tmp_path)
    assert found is not None
    assert found.version == 1


def test_version_2_moves_the_grader_aside_and_passes_the_controllers_down(tmp_path: Path):
    own = dict(line.split(":")[1:] for line in Path("/proc/self/cgroup").read_text().split())
    folder = tmp_path / own.get("", "/").lstrip("/")
    folder.mkdir(parents=True, exist_ok=True)
    (tmp_path / "cgroup.controllers").write_text("memory pids")
    (folder / "cgroup.procs").write_text("1\n")
    found = cgroup.find_hierarchy(tmp_path)
    assert found is not None
    assert found.version == 2
    assert (folder / "cgroup.subtree_control").read_text() == "+memory +pids"
    [aside] = folder.glob("ros2-course-kit-self.*")
    assert (aside / "cgroup.procs").read_text() == "1"
