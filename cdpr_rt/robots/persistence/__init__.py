"""State of a robot kept from one run to the next: cable lengths, and the calibration in force."""
