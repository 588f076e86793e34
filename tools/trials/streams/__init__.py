"""Trials of set-point streams."""
