"""Calibration of a robot's geometry: what it observes, the fit, and how good it is."""
