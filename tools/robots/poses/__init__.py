"""Poses that a robot reaches: chosen, written to a file, drawn."""
