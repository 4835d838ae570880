"""Tests of the grader on this host: attacks by hostile submissions. Not in the students' kit."""
