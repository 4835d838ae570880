"""The fixtures for tests of notebooks."""

from helpers.notebook_fixtures import answer, built_example, example, rubric, source_page, stored_page

__all__ = ["answer", "built_example", "example", "rubric", "source_page", "stored_page"]
