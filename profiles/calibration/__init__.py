"""Calibrations of a robot's geometry, kept beside its file."""
