"""Attacks on the grader as submissions that can be run: `grader attack`."""
