"""`cdpr calibrate`, `camera` and `markers`."""
