"""Work with cable tensions: watch them, calibrate a winch by them."""
