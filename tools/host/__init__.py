"""Checks of the machine that runs the loop."""
