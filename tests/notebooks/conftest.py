"""The fixtures for tests of notebooks."""

from helpers.notebook_fixtures import answer, built_example, example, published_page, rubric, source_page, student_page

__all__ = ["answer", "built_example", "example", "published_page", "rubric", "source_page", "student_page"]
