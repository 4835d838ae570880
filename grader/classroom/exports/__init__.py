"""The gradebook in the forms that learning platforms import. docs/classes.md describes each."""
