"""A simulated camera on a simulated platform, which renders images of markers."""
