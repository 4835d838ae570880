"""The kit's own course: a robot that drives safely."""
