"""Cameras: one interface, and what is behind it."""
