"""Runs a command several times and compares what it writes."""
