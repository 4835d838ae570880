"""The trials of the kit's own course. To add one, add a decorated function to a file here, or a new file."""
