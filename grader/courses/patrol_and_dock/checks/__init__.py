"""The checks of the capstone."""
