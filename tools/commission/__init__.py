"""Commissioning of motors and load cells, with reports."""
