"""Paths: read from way points or G-code, drawn through blended corners, timed within limits."""
