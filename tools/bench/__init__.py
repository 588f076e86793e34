"""Measurements of the project's own cost, each against something that anyone can check it by."""
