"""Service: interfaces of the control loop for people and programs, in a separate process."""
