"""Profiles of rails, safety I/O and load cells."""
