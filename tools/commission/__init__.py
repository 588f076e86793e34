"""Commissioning at the terminal: all motors of a robot in turn, and the table of results."""
