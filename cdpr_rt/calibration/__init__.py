"""Calibration of a robot's geometry: what it observes, the fit, how good it is, what it leaves open."""
