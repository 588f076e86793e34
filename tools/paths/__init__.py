"""Paths on the command line: preview, picture, and following them."""
