"""The daemon's composition: its processes and their settings."""
