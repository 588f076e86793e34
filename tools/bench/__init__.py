"""Benchmarks of this software's own cost, each compared with something that anyone can check."""
