"""The courses that come with the kit."""
