"""The `ros2` commands, one module each: words and flags as the real command has them."""
