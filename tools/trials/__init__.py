"""Trials of a whole robot on its simulator: what it was told, what it did, what was true."""
