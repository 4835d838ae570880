"""The cases with which the package's functions are called."""
