"""cdpr bus."""
