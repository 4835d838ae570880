"""A workspace of its own for each test."""

from helpers.notebook_fixtures import workspace
