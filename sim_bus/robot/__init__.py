"""Physics: motors, cables and platform, and logs of their true state."""
