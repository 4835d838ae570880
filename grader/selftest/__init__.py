"""Tests of the grader on this host: attacks by hostile submissions, and flakiness. Not in the students' kit."""
