"""Attacks on the grader, as submissions that can be graded: `grader self-test`."""
