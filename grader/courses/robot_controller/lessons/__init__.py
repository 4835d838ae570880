"""What the notebooks of this course import beside the engine's functions, as `grader.notebook.NAME`."""
