"""Reading of files that people write: bounds, units, messages."""
