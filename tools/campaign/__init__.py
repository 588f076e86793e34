"""Fault campaigns: many seeds of users' actions and faults on simulated robots, and their judge."""
