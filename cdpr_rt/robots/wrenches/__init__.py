"""Wrenches that tensions within bounds can exert, and those that a motion takes."""
