"""A class: find the submissions of an export, grade them all, keep the results, make the gradebook."""
