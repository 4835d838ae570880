"""Tests of the grader itself on this host: attacks by hostile submissions, and flakiness. Not in the students' kit."""
