"""The `ros2` command, with `launch` where the real one is missing. Imports nothing of the kit outside this folder."""
