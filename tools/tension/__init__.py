"""Cable tensions at the terminal: watch them, and calibrate a winch with them."""
