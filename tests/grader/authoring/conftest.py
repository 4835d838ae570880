"""The fixtures for tests of notebooks, and a workspace of its own for each test."""

from helpers.notebook_fixtures import answer, built_example, example, rubric, source_page, stored_page, workspace

__all__ = ["answer", "built_example", "example", "rubric", "source_page", "stored_page", "workspace"]
