"""Take in what was handed in: list it, decide what to keep, copy that, find the package. Nothing of it is run."""
