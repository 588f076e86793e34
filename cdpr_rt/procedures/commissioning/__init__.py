"""Commissioning of one winch's motor: recorded passes, identification, validation."""
