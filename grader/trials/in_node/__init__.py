"""What runs at the start of each Python of a trial; mounted alone into its sandbox."""
