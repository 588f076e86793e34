"""Cameras: one interface and its implementations."""
