"""Take in a submission: list it, decide what to keep, copy that, find the package. Runs nothing of it."""
