"""Client of a running daemon."""
