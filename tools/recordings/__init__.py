"""What `cdpr log` does with recordings."""
