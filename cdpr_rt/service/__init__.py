"""Service: the control loop's interfaces to people and programs, in a separate process."""
