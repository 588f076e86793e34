"""Bench of path planning: a large file as CAM writes it, beside what else would plan it."""
