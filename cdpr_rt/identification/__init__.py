"""Cogging, friction and inertia of a motor from recorded runs, by two methods."""
