"""Recordings of other programs, converted to the files that this project's commands read."""
