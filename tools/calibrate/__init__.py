"""Calibration of geometry at the terminal: the simulated robot, files and pictures."""
