"""The control loop: cycle engine, transitions, safe stop, commands, status."""
