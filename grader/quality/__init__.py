"""What a package's text shows: style, docstrings, structure, habits, README, package.xml. Read, never run."""
