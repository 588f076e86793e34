"""Every limit of a robot, and what is done about each that is exceeded."""
