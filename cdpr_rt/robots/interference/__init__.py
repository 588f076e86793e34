"""Interference of cables with each other, the platform, and boxes of the frame."""
