"""Calibration of a robot's geometry: observations, fit, how good it is, what stays open."""
