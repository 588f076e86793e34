"""What serves the control loop to people and programs, from a process of its own."""
