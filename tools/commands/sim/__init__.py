"""cdpr sim."""
