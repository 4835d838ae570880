"""The capstone: a patrol that docks."""
