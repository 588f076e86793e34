"""Identification of cogging and friction from sweeps."""
