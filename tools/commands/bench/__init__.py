"""cdpr bench."""
