"""Marker maps: detection, bundle adjustment, diagnosis."""
