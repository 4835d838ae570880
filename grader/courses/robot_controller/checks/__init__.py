"""The checks of the kit's own course, for what no other course has: see checks_run for where others are."""
