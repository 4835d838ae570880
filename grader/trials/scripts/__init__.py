"""The trials themselves. Add a file here, or a function to one, and it is run."""
