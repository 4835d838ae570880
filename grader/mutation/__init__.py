"""Mutate a package's source and see whether its own tests notice. Equivalent mutants keep this fair."""
