"""Programs that move each axis by itself."""
