"""Assembles a robot from its file: buses, drives, devices, loop."""
