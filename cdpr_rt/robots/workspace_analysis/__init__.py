"""Extent of a robot's workspace: by rays from a centre, by a grid, as a surface."""
