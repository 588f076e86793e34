"""Tension distribution of n cables."""
