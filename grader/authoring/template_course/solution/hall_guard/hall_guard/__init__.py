"""A guard in a hall."""
