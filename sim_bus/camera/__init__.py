"""A simulated camera on a simulated platform: what it sees of markers, rendered."""
