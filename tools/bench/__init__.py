"""Benchmarks of the project's own cost, each compared with something that anyone can check."""
