"""Linear rails that move exit points."""
