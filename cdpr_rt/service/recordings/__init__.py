"""Recordings: written, described, read."""
