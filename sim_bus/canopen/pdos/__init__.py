"""PDOs of a simulated node."""
