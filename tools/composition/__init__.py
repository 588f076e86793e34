"""Puts a robot together from its file: buses, drives, devices, loop."""
