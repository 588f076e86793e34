"""Procedures that calibrate a robot's geometry."""
