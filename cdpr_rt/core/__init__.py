"""Exchange, cycle, clock, estimate, limits, supervisor and recorded row, for every robot."""
