"""Printed markers: sheets of them, and pictures of their maps."""
