"""Limits of robots and motors: their kinds, figures and bounds."""
