"""A stand-in for `launch` and `launch_ros` in the process that runs a launch file."""
