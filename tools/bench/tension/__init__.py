"""Tension distribution measured: what it costs, what it finds, how smooth it is along paths."""
