"""The checks: pytest tests over evidence, for one requirement or a part of it each. Students read their docstrings."""
