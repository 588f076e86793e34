"""Paths of a platform: plans kept and checked, followed in the cycle, and how far one has come."""
