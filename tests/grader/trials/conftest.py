"""What the tests of trials share."""

from helpers.short_nodes import run
