"""The checks: pytest tests over evidence, one for each requirement or part of it; students read their docstrings."""
