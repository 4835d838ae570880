"""What the nodes promise in every world, and how worlds are made up."""
