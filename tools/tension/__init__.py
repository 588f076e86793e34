"""Cable tensions at the terminal: watched, and what a calibration by them needs and shows."""
