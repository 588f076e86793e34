"""Procedures that operate a loop: commissioning of a winch's motor, calibration by tension."""
