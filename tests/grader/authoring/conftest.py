"""The fixtures for tests of notebooks, and a workspace of its own for each test."""

from helpers.notebook_fixtures import (
    answer,
    built_example,
    example,
    published_page,
    rubric,
    source_page,
    student_page,
    workspace,
)

__all__ = ["answer", "built_example", "example", "published_page", "rubric", "source_page", "student_page", "workspace"]
