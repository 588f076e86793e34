"""Trials of a whole robot on its simulator: its commands, its motion and the truth."""
