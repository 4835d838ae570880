"""The `ros2` commands, one module each, with the arguments and flags of the real ones."""
