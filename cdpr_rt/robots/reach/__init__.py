"""Straight motions that are held all the way and without contact."""
