"""The example of a notebook that tests of notebooks share."""

from helpers.notebook_fixtures import built_example, example, notebook, rubric
