"""The fixtures for tests of notebooks, and a workspace of its own for each test."""

from helpers.notebook_fixtures import (
    built_example,
    example,
    notebook,
    published_page,
    rubric,
    source_page,
    student_page,
    workspace,
)

__all__ = [
    "built_example",
    "example",
    "notebook",
    "published_page",
    "rubric",
    "source_page",
    "student_page",
    "workspace",
]
