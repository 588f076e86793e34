"""Calibration of a winch by known tensions: hung masses, or a made-fast cable with a load cell."""
