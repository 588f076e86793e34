"""Readings of a calibration: files, and arrays for the fit."""
