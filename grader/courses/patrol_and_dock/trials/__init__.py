"""The trials of the capstone."""
