"""Programs that move the platform by all its cables."""
