"""Object dictionary, data types, stored parameters."""
