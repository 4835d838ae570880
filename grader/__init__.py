"""Grade a ROS 2 package: build it, wall it in, drive it through trials, score what was seen."""
