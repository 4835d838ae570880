"""Coverage's tracer rests while rclpy's executors look for what is ready; what it measures of a node is the same."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

from grader import KIT

pytestmark = [pytest.mark.ros, pytest.mark.slow]  # a measurement

# Every branch is taken in every run, however long a callback waits for its turn.
NODE = """
    import threading

    import rclpy
    from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
    from rclpy.node import Node


    class Counter(Node):
        def __init__(self, name, most=4):
            super().__init__(name)
            self.most, self.count, self.done = most, 0, rclpy.Future()
            self.create_timer(0.01, self.tick)

        def tick(self):
            self.count += 1
            if self.count % 2:
                return self.odd()
            if self.count >= self.most:
                self.done.set_result(True)

        def odd(self):
            if self.count > 1:
                if self.most < 4:
                    raise ValueError("too many")
            return None

    def spin_once():
        node = Counter("once")
        while not node.done.done():
            rclpy.spin_once(node, timeout_sec=0.005)
        return node


    def spin_until():
        node = Counter("until")
        rclpy.spin_until_future_complete(node, node.done)
        return node


    def spin_in_a_thread(executor):
        node = Counter("threaded")
        executor.add_node(node)
        thread = threading.Thread(target=executor.spin_until_future_complete, args=(node.done,))
        thread.start()
        thread.join()
        return node


    def spin_until_it_raises():
        node = Counter("raising", most=3)
        try:
            rclpy.spin(node)
        except ValueError:
            node.count = 0
        return node


    def main():
        rclpy.init()
        nodes = [spin_once(), spin_until(), spin_in_a_thread(SingleThreadedExecutor())]
        nodes.append(spin_in_a_thread(MultiThreadedExecutor(2)))
        nodes.append(spin_until_it_raises())
        if all(nodes):
            print(len(nodes))
"""
MEASURE = """
    import json, runpy, sys
    import coverage
    import rclpy.executors

    Executor = rclpy.executors.Executor
    looking, traced = Executor._wait_for_ready_callbacks, set()

    def note(*arguments, **options):
        traced.add(sys.gettrace() is not None)
        return looking(*arguments, **options)

    Executor._wait_for_ready_callbacks = note
    measure = coverage.Coverage(data_file=None, config_file=False, branch=True, include=["*/counter.py"])
    keep_out = runpy.run_path(sys.argv[2])["keep_out_of_executors"]
    measure.start()
    if sys.argv[1] == "resting":
        keep_out()
    import counter
    counter.main()
    measure.stop()
    data = measure.get_data()
    [file] = data.measured_files()
    print(json.dumps([sorted(traced), sorted(data.arcs(file))]))
"""


def test_the_same_branches_are_measured_while_the_tracer_rests(tmp_path: Path):
    (tmp_path / "counter.py").write_text(dedent(NODE))

    def measured(how: str) -> tuple[list[bool], list[list[int]]]:
        runner = KIT / "grader" / "student_tests" / "pytest_run.py"
        ran = subprocess.run(
            [sys.executable, "-c", dedent(MEASURE), how, str(runner)],
            cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert ran.returncode == 0, ran.stderr
        traced, arcs = json.loads(ran.stdout.splitlines()[-1])
        return traced, arcs

    (usual, arcs), (resting, arcs_then) = measured("usual"), measured("resting")
    assert (usual, resting) == ([True], [False])
    assert len(arcs) > 40
    assert arcs_then == arcs
