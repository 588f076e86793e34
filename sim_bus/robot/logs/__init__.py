"""What is true of a simulated robot, recorded for reports and tests alone."""
