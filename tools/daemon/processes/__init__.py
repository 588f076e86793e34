"""The daemon's processes, and the launcher above them."""
