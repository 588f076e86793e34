"""cdpr drive."""
