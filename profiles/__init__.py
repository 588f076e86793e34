"""Motors, drives, winches, cables and robots as validated data."""
