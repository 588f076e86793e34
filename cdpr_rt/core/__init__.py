"""Exchange, cycle, clock, estimate, limits, supervisor and recorded row of every robot."""
