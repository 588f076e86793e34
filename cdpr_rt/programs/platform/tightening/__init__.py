"""Tightening of a platform's cables, from slack ones to a pose that is controlled."""
