"""Reachable poses measured: how many a second, and whether brute force agrees."""
