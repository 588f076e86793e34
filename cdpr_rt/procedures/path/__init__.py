"""Planning a path for a robot: its motion in time, what its cables hold, and what is in its way."""
