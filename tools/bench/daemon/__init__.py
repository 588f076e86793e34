"""Benchmarks of a whole daemon."""
