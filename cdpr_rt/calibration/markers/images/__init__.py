"""Detection of markers in images."""
