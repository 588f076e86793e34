"""Physics: motors, cables, platform, and the logs of what is true."""
