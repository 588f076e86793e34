"""Prediction of what a platform does when one of its cables breaks."""
