"""The fixtures for tests of notebooks."""

from helpers.notebook_fixtures import (
    built_example,
    example,
    notebook,
    published_page,
    rubric,
    source_page,
    student_page,
)

__all__ = ["built_example", "example", "notebook", "published_page", "rubric", "source_page", "student_page"]
