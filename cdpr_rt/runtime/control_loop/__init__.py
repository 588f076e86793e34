"""The control loop: its engine, transitions, safe stop, commands and status."""
