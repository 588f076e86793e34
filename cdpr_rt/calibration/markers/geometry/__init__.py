"""Rotations, lenses, and squares seen through them."""
