"""Calibration of a robot's geometry: parameters, fit, faults, verdict."""
