"""Print how long calls of the `ros2` command take on this machine, the minimum and median of five. Not a test."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time

from grader import KIT

COMMAND = KIT / "grader" / "ros2"
CALLS = (
    "pkg list",
    "interface show std_srvs/srv/SetBool",
    "run rclpy none",
    "node list",
    "topic list -t",
    "topic pub --once -w 0 /x std_msgs/msg/String {data:\\ hi}",
)


def main() -> None:
    """Time each call beside an idle node in the same domain."""
    env = {**os.environ, "ROS2_COURSE_KIT_OWN": "1", "ROS_DOMAIN_ID": "61"}
    idle = subprocess.Popen([sys.executable, "-c", "import rclpy; rclpy.init(); rclpy.spin(rclpy.create_node('idle'))"],
                            env=env, stderr=subprocess.DEVNULL)  # fmt: skip
    time.sleep(2)
    try:
        for call in CALLS:
            words = [word.replace("\\", "") for word in call.replace("\\ ", "\0").split()]
            times = []
            for _ in range(5):
                begin = time.perf_counter()
                subprocess.run([sys.executable, COMMAND, *(w.replace("\0", " ") for w in words)], env=env,
                               capture_output=True, check=False)  # fmt: skip
                times.append(time.perf_counter() - begin)
            print(f"{min(times):5.2f} s {statistics.median(times):5.2f} s  ros2 {call}")
    finally:
        idle.terminate()
        idle.wait()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
