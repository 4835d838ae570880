"""This machine: tools, limits, /proc, cgroups, the ROS environment, temporary folders. Standard library only."""
