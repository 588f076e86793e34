"""Commissioning of winches: procedure, files, results."""
